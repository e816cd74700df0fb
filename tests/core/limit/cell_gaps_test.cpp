// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_gaps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Pairs of control cells, the lesser number first.
std::set<std::pair<std::uint32_t, std::uint32_t>> pairs_across_gaps(const ControlMesh& mesh) {
  const std::shared_ptr<const LimitSolid> solid = LimitSolid::prepare(mesh);
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

}  // namespace
}  // namespace ccslice
