// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit evaluation against brute force: tiny meshes refined to level 4 as a whole, at the exact dyadic points that the
// masks give. The last refinement goes one control cell with its surroundings at a time, so that memory stays small.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <span>
#include <vector>

#include "tests/oracle/subject.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kTolerance = 1e-9;
constexpr int kLevelOfWhole = 3;
constexpr int kMostRefinedVertices = 40;  // In one mesh: their limits take a refinement each.

class WholeMesh : public testing::TestWithParam<std::size_t> {
 protected:
  WholeMesh() : subject_(tiny_meshes()[GetParam()].mesh), evaluator_(subject_.solid()) {}

  /// Two opposite corners of a cell, others in other cells. `limits`: those known, by vertex.
  void compare_corners(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t cell_id,
                       std::vector<PointValue>& limits) {
    const BruteCell& cell = mesh.cells[cell_id];
    for (const int bits : {static_cast<int>(compared_ * 5 % 8), static_cast<int>(~(compared_ * 5) % 8)}) {
      const std::uint32_t v = cell.v[kVtkCorner[bits]];
      if (limits[v].size() == 0) {
        if (!has_limit_mask(mesh, topology, v) && ++refined_vertices_ > kMostRefinedVertices) continue;
        limits[v] = limit_point(mesh, topology, v);
      }
      subject_.compare(evaluator_, subject_.locate_corner(cell.from, bits), limits[v], worst_);
    }
    ++compared_;
  }

  /// The children of some cells, refined within their one-ring.
  void compare_children(const BruteMesh& mesh, const BruteTopology& topology, std::span<const std::uint32_t> cells) {
    std::vector<std::uint32_t> vertices;
    for (const std::uint32_t c : cells) vertices.insert(vertices.end(), mesh.cells[c].v.begin(), mesh.cells[c].v.end());
    const std::vector<std::uint32_t> block = cells_round(topology, vertices);
    const CutOut cut = cut_out(mesh, block);
    const Refined fine = refine(cut.mesh, build_topology(cut.mesh.cells, cut.mesh.vertex_count()));
    const BruteTopology fine_topology = build_topology(fine.mesh.cells, fine.mesh.vertex_count());
    std::vector<PointValue> limits(fine.mesh.vertex_count());
    for (const std::uint32_t c : cells) {
      const auto kept = static_cast<std::size_t>(std::ranges::lower_bound(block, c) - block.begin());
      for (std::uint32_t i = 0; i < 8; ++i)
        compare_corners(fine.mesh, fine_topology, fine.first_child[kept] + i, limits);
    }
  }

  Subject subject_;
  LimitEvaluator evaluator_;
  WorstError worst_;
  std::size_t compared_ = 0;
  int refined_vertices_ = 0;
};

TEST_P(WholeMesh, LimitAgreesWithBruteForce) {
  BruteMesh mesh = subject_.brute();
  BruteTopology topology = subject_.topology();
  for (int level = 0; level < kLevelOfWhole; ++level) {
    mesh = refine(mesh, topology).mesh;
    topology = build_topology(mesh.cells, mesh.vertex_count());
  }
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_control_cell;
  for (std::uint32_t c = 0; c < mesh.cells.size(); ++c) by_control_cell[mesh.cells[c].from.control_cell].push_back(c);
  for (const auto& [control_cell, cells] : by_control_cell) compare_children(mesh, topology, cells);
  EXPECT_EQ(compared_, 8 * mesh.cells.size());
  EXPECT_GT(worst_.samples, compared_);
  EXPECT_LT(worst_.position, kTolerance) << worst_.position_at;
  EXPECT_LT(worst_.channel, kTolerance) << worst_.channel_at;
}

// limit_one_ring_test.cpp goes deeper on each of them.
INSTANTIATE_TEST_SUITE_P(TinyMeshes, WholeMesh, testing::Range<std::size_t>(0, tiny_meshes().size(), 4),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

INSTANTIATE_TEST_SUITE_P(NightlyTinyMeshes, WholeMesh, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

}  // namespace
}  // namespace ccslice::oracle
