// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/region_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/allocation_count.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

constexpr std::uint8_t kOutside = kNoCellRegion;

struct Text {
  std::string operator()(const std::vector<RegionRun>& runs) const {
    std::string text;
    for (const RegionRun& run : runs) {
      text += std::to_string(run.row) + ":" + std::to_string(run.begin) + "-" + std::to_string(run.end) + "=" +
              std::to_string(run.region) + " ";
    }
    return text;
  }
};

/// The square [0, 8] x [0, 2] in two halves that meet at x, the left one region 0.
std::vector<RegionEdge> halves(double x, bool mirrored_interface = false) {
  const Vec2 low(x, 0), high(x, 2);
  return {{{0, 0}, low, 0, kOutside},
          {low, {8, 0}, 1, kOutside},
          {{8, 0}, {8, 2}, 1, kOutside},
          {{8, 2}, high, 1, kOutside},
          {high, {0, 2}, 0, kOutside},
          {{0, 2}, {0, 0}, 0, kOutside},
          mirrored_interface ? RegionEdge{high, low, 1, 0} : RegionEdge{low, high, 0, 1}};
}

const LayerLattice kLattice{.width = 8, .height = 2};
const std::vector<VoxelRun> kSpans = {{0, 0, 8}, {1, 0, 8}};

TEST(RegionRuns, PartSpansWhereRegionsMeet) {
  EXPECT_EQ(Text()(find_regions(halves(3.2), kSpans, kLattice)), "0:0-3=0 0:3-8=1 1:0-3=0 1:3-8=1 ");
  EXPECT_EQ(Text()(find_regions(halves(3.2, true), kSpans, kLattice)), "0:0-3=0 0:3-8=1 1:0-3=0 1:3-8=1 ");
}

TEST(RegionRuns, GiveACentreOnAnInterfaceToTheRight) {
  EXPECT_EQ(Text()(find_regions(halves(2.5), kSpans, kLattice)), "0:0-2=0 0:2-8=1 1:0-2=0 1:2-8=1 ");
}

TEST(RegionRuns, LeaveOutOtherRows) {
  EXPECT_EQ(Text()(find_regions(halves(4), std::span(kSpans).subspan(1), kLattice, {1, 2})), "1:0-4=0 1:4-8=1 ");
}

TEST(RegionRuns, PreferTheLowestOfRegionsThatOverlap) {
  std::vector<RegionEdge> edges = halves(4);
  for (RegionEdge edge : halves(8)) {
    if (edge.left == 0) edges.push_back({edge.from, edge.to, 2, edge.right == 1 ? kOutside : edge.right});
  }
  EXPECT_EQ(Text()(find_regions(edges, kSpans, kLattice)), "0:0-4=0 0:4-8=1 1:0-4=0 1:4-8=1 ");
}

TEST(RegionRuns, FillVoxelsInNoRegionFromBesideThem) {
  std::vector<RegionEdge> moved = halves(4);
  for (RegionEdge& edge : moved) edge.from.x() += 1, edge.to.x() += 1;
  const LayerLattice lattice{.width = 10, .height = 2};
  EXPECT_EQ(Text()(find_regions(moved, std::vector<VoxelRun>{{0, 0, 10}}, lattice)), "0:0-5=0 0:5-10=1 ");
}

// Held all at once, the crossings take 160 MB.
TEST(RegionRuns, OfManyTallEdgesHoldCrossingsOfSomeRowsAtATime) {
  constexpr std::uint32_t kHeight = 50'000;
  std::vector<RegionEdge> edges;
  for (int k = 0; k < 100; ++k) {
    for (RegionEdge edge : halves(3.2)) {
      edge.from.y() *= kHeight / 2;
      edge.to.y() *= kHeight / 2;
      edges.push_back(edge);
    }
  }
  std::vector<VoxelRun> spans;  // Rows are left out within bands, and whole bands.
  for (std::uint32_t row = 7; row < kHeight; row += row % 20'000 < 3'000 ? 5 : 19'999) spans.push_back({row, 0, 8});
  const LayerLattice lattice{.width = 8, .height = kHeight};
  const oracle::HeldMemory held;
  const std::vector<RegionRun> runs = find_regions(edges, spans, lattice);
  EXPECT_LT(held.most_bytes(), (16u << 20) + 2 * runs.capacity() * sizeof(RegionRun));
  ASSERT_EQ(runs.size(), 2 * spans.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    ASSERT_EQ(runs[k].row, spans[k / 2].row);
    ASSERT_EQ(runs[k].begin, k % 2 == 0 ? 0u : 3u);
    ASSERT_EQ(runs[k].region, k % 2);
  }
}

TEST(RegionRuns, LeaveNoVoxelOutside) { EXPECT_EQ(Text()(find_regions({}, kSpans, kLattice)), "0:0-8=0 1:0-8=0 "); }

TEST(RegionRuns, AreDrawnAsNumbersFromOne) {
  std::vector<std::uint8_t> numbers;
  draw_regions(find_regions(halves(3), kSpans, kLattice), {2, 1, 3, 1}, numbers);
  EXPECT_THAT(numbers, ElementsAre(1, 2, 2));
  draw_regions({}, {0, 0, 2, 1}, numbers);
  EXPECT_THAT(numbers, ElementsAre(0, 0));
}

}  // namespace
}  // namespace ccslice
