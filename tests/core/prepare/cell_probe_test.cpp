// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/cell_probe.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(CellProbe, TellsHowDeepAPointIsBelowTheBoundary) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  CellProbe probe(*solid);
  int found = 0;
  for (const LimitCellId cell : solid->cells()) {
    const auto at = probe.find(cell, Vec3(15, 14, 9.75));
    if (!at) continue;
    ++found;
    EXPECT_NEAR(at->depth_mm, 9.75, 1e-6);
    EXPECT_NEAR(std::abs(at->inverse_jacobian.determinant()), 1e-3, 1e-9);
  }
  EXPECT_EQ(found, 1);
}

TEST(CellProbe, FindsNothingOffACellAndNothingAtTheBoundary) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  CellProbe probe(*solid);
  const LimitCellId cell{0};
  EXPECT_FALSE(probe.find(cell, Vec3(-1, 5, 5)));
  EXPECT_FALSE(probe.find(cell, Vec3(5, 5, 10)));
  EXPECT_FALSE(probe.find(cell, Vec3(5, 5, 10 - 0.5 * kLeastOverlapMm)));
  const auto at = probe.find(cell, Vec3(5, 5, 10 - 2 * kLeastOverlapMm));
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->depth_mm, 2 * kLeastOverlapMm, 1e-9);
}

TEST(CellProbe, KnowsNoDepthInACellWithoutBoundary) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  CellProbe probe(*solid);
  for (const LimitCellId cell : solid->cells()) {
    const auto at = probe.find(cell, Vec3(15, 15, 15));
    EXPECT_EQ(at && std::isinf(at->depth_mm), solid->boundary_sides(cell) == 0);
  }
}

}  // namespace
}  // namespace ccslice
