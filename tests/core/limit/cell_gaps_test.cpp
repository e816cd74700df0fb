// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_gaps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Pairs of control cells, the lesser number first.
std::set<std::pair<std::uint32_t, std::uint32_t>> pairs_across_gaps(const ControlMesh& mesh) {
  const std::shared_ptr<const LimitSolid> solid = prepare_solid(mesh);
  std::vector<LimitCellId> all;
  for (const LimitCellId cell : solid->cells()) all.push_back(cell);
  std::set<std::pair<std::uint32_t, std::uint32_t>> found;
  for (const LimitCellId a : all) {
    for (const LimitCellId b : all) {
      if (a == b || !solid->touch(a, b) || !is_across_a_gap(*solid, a, b, all)) continue;
      const std::uint32_t one = solid->control_cell(a), other = solid->control_cell(b);
      found.emplace(std::min(one, other), std::max(one, other));
    }
  }
  return found;
}

TEST(CellGaps, AreNotInBoxesNorRoundReentrantCorners) {
  EXPECT_TRUE(pairs_across_gaps(oracle::box_mesh(3, 3, 3)).empty());
  EXPECT_TRUE(
      pairs_across_gaps(oracle::box_mesh(2, 2, 2, 10, [](int x, int y, int z) { return x + y + z > 0; })).empty());
  EXPECT_TRUE(pairs_across_gaps(oracle::box_mesh(2, 2, 2, 10, [](int x, int y, int) { return x + y > 0; })).empty());
}

// Cells 0 to 3 are below, 4 to 7 above, and 0 and 4 share a face.
TEST(CellGaps, AreBetweenLobesThatShareAnEdgeOrAVertex) {
  const std::set<std::pair<std::uint32_t, std::uint32_t>> expected = {{1, 5}, {1, 7}, {2, 6}, {2, 7},
                                                                      {3, 5}, {3, 6}, {3, 7}};
  EXPECT_EQ(pairs_across_gaps(oracle::vertex_slit(0.5, 2)), expected);
}

// Cells 0 to 15 are below. Cells 10 and 26 share three vertices, 11 and 26 one.
TEST(CellGaps, AreRoundTheInnerCornerOfASlit) {
  const auto found = pairs_across_gaps(oracle::vertex_slit(0.5, 4, /*only_a_quarter=*/true));
  for (const auto& pair : std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{
           {10, 26}, {11, 26}, {10, 27}, {14, 26}, {10, 30}}) {
    EXPECT_TRUE(found.contains(pair)) << pair.first << ", " << pair.second;
  }
  for (const auto& [below, above] : found) {
    EXPECT_LT(below, 16u);
    EXPECT_GE(above, 16u) << below;
  }
}

// Cell 0 lies round the end, 1 and 2 are on either side of the slit. Cells 9, 10 and 11 are beside them.
TEST(CellGaps, AreBetweenLobesRoundWhoseSlitASingleCellLies) {
  const std::set<std::pair<std::uint32_t, std::uint32_t>> expected = {{1, 2}, {10, 11}};
  EXPECT_EQ(pairs_across_gaps(oracle::forked_slit(0.5)), expected);
}

// Diagonal ones share an edge from the boundary to the boundary, where they have faces that look to either side.
TEST(CellGaps, AreNotInThinPlates) { EXPECT_TRUE(pairs_across_gaps(oracle::box_mesh(3, 3, 1)).empty()); }

// Three vertices that two tetrahedra share are a face.
TEST(CellGaps, AreNotBetweenTetrahedraThatShareAFace) {
  const ControlMesh mesh = oracle::kuhn_box(1);
  for (const auto& [one, other] : pairs_across_gaps(mesh)) {
    const auto corner = [&](std::uint32_t cell, std::size_t k) { return mesh.cell_vertices[4 * cell + k]; };
    int common = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) common += corner(one, i) == corner(other, j) ? 1 : 0;
    }
    EXPECT_LT(common, 3) << one << ", " << other;
  }
}

}  // namespace
}  // namespace ccslice
