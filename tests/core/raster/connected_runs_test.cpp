// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/connected_runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

namespace ccslice {
namespace {

std::vector<std::size_t> labels_of(const std::vector<VoxelRun>& runs, ConnectedRuns& connected) {
  const std::size_t parts = connected.label(runs);
  std::vector<std::size_t> labels;
  std::size_t most = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    labels.push_back(connected.of_run(r));
    most = std::max(most, labels.back() + 1);
  }
  EXPECT_EQ(parts, most);
  return labels;
}

std::vector<std::size_t> labels_of(const std::vector<VoxelRun>& runs) {
  ConnectedRuns connected;
  return labels_of(runs, connected);
}

using Labels = std::vector<std::size_t>;

TEST(ConnectedRuns, OfNothingAreNone) {
  ConnectedRuns connected;
  EXPECT_EQ(connected.label({}), 0u);
}

TEST(ConnectedRuns, ShareAFaceWithinALayer) {
  EXPECT_EQ(labels_of({{0, 5, 2, 4}}), Labels({0}));
  EXPECT_EQ(labels_of({{0, 5, 2, 4}, {0, 6, 3, 9}}), Labels({0, 0}));
  EXPECT_EQ(labels_of({{0, 5, 2, 4}, {0, 6, 4, 9}}), Labels({0, 1})) << "they share an edge";
  EXPECT_EQ(labels_of({{0, 5, 4, 9}, {0, 6, 2, 4}}), Labels({0, 1}));
  EXPECT_EQ(labels_of({{0, 5, 2, 4}, {0, 7, 2, 4}}), Labels({0, 1})) << "a row lies between";
  EXPECT_EQ(labels_of({{0, 5, 2, 4}, {0, 5, 6, 8}}), Labels({0, 1}));
}

TEST(ConnectedRuns, ShareAFaceAcrossLayers) {
  EXPECT_EQ(labels_of({{3, 5, 2, 4}, {4, 5, 3, 4}}), Labels({0, 0}));
  EXPECT_EQ(labels_of({{3, 5, 2, 4}, {4, 5, 4, 6}}), Labels({0, 1}));
  EXPECT_EQ(labels_of({{3, 5, 2, 4}, {4, 6, 2, 4}}), Labels({0, 1}));
  EXPECT_EQ(labels_of({{3, 5, 2, 4}, {5, 5, 2, 4}}), Labels({0, 1}));
}

TEST(ConnectedRuns, AForkIsOnePart) {
  EXPECT_EQ(labels_of({{0, 1, 0, 2}, {0, 1, 4, 6}, {0, 1, 8, 9}, {0, 2, 0, 6}, {0, 2, 8, 9}}), Labels({0, 0, 1, 0, 1}));
}

TEST(ConnectedRuns, PartsThatMeetLateAreOne) {
  // Two columns, joined by their last row; then the last layer.
  EXPECT_EQ(labels_of({{0, 1, 0, 1}, {0, 1, 5, 6}, {0, 2, 0, 1}, {0, 2, 5, 6}, {0, 3, 0, 6}}), Labels({0, 0, 0, 0, 0}));
  EXPECT_EQ(labels_of({{0, 1, 0, 1}, {0, 1, 5, 6}, {0, 9, 0, 1}, {1, 1, 0, 6}}), Labels({0, 0, 1, 0}));
}

using Voxel = std::array<std::uint32_t, 3>;  // Layer, row, column.

void flood(const Voxel& from, std::size_t label, std::map<Voxel, std::size_t>& labels) {
  std::vector<Voxel> open = {from};
  while (!open.empty()) {
    const Voxel voxel = open.back();
    open.pop_back();
    const auto found = labels.find(voxel);
    if (found == labels.end() || found->second != SIZE_MAX) continue;
    found->second = label;
    for (std::size_t a = 0; a < 3; ++a) {
      for (const std::uint32_t step : {1u, UINT32_MAX}) {
        Voxel next = voxel;
        next[a] += step;
        open.push_back(next);
      }
    }
  }
}

TEST(ConnectedRuns, AgreeWithAFloodFill) {
  std::mt19937 random(11);
  ConnectedRuns connected;
  for (int trial = 0; trial < 300; ++trial) {
    const unsigned layers = 1 + random() % 4, rows = 1 + random() % 8, columns = 1 + random() % 12;
    const unsigned percent = 20 + random() % 70;
    std::map<Voxel, std::size_t> flooded;
    std::vector<VoxelRun> runs;
    for (std::uint32_t layer = 0; layer < layers; ++layer) {
      for (std::uint32_t row = 0; row < rows; ++row) {
        bool inside = false;
        for (std::uint32_t column = 0; column < columns; ++column) {
          const bool was_inside = inside;
          inside = random() % 100 < percent;
          if (!inside) continue;
          flooded[{layer, row, column}] = SIZE_MAX;
          if (was_inside) {
            ++runs.back().end;
          } else {
            runs.push_back({layer, row, column, column + 1});
          }
        }
      }
    }
    std::size_t parts = 0;
    for (const VoxelRun& run : runs) {
      const Voxel first{run.layer, run.row, run.begin};
      if (flooded.at(first) == SIZE_MAX) flood(first, parts++, flooded);
    }
    const std::vector<std::size_t> labels = labels_of(runs, connected);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      ASSERT_EQ(labels[r], flooded.at({runs[r].layer, runs[r].row, runs[r].begin}))
          << "trial " << trial << " run " << r;
    }
  }
}

}  // namespace
}  // namespace ccslice
