// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/acceptance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// 3 x 3 x 3 cubes, exactly: edges and corners are sharp.
std::shared_ptr<const LimitSolid> cubes(double size_mm, const Vec3& offset_mm = Vec3::Zero()) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3, 1);
  oracle::sharpen_by_cells(mesh, 1);
  for (Vec3& p : mesh.positions) p = size_mm * p + offset_mm;
  return prepare_solid(mesh);
}

// Frobenius' norm of a cube's inverse Jacobian is sqrt(3) / size.
TEST(Acceptance, IsAShareOfTheCellOrTheMostAllowed) {
  for (const double size_mm : {0.01, 0.5, 3.0, 10.0}) {
    const auto solid = cubes(size_mm);
    const Acceptance acceptance(*solid, 1e-6);
    const double share = kAcceptOfCell * size_mm / std::sqrt(3.0), expected = std::min(share, 1e-6);
    for (const LimitCellId cell : solid->cells()) {
      EXPECT_NEAR(acceptance.in_cell(cell), expected, std::numeric_limits<float>::epsilon() * expected) << size_mm;
    }
    EXPECT_NEAR(acceptance.at(Mat3::Identity() / size_mm), expected, 1e-9 * expected);
  }
}

TEST(Acceptance, FollowsTheThinnestDirection) {
  const auto solid = cubes(10);
  const Acceptance acceptance(*solid, 1e-6);
  EXPECT_NEAR(acceptance.at(Vec3(1e-1, 1e-1, 1e3).asDiagonal()), kAcceptOfCell * 1e-3, 1e-16);
}

TEST(Acceptance, AsksForNoMoreThanDoublesCanTellApart) {
  const auto small = cubes(1e-3);
  // A box of 3 cells of a micrometre: 1e-12 of its diagonal.
  EXPECT_NEAR(Acceptance(*small, 1e-6).least_mm(), 1e-12 * 3e-3 * std::sqrt(3.0), 1e-18);
  const auto far_away = cubes(1e-3, Vec3(0, -2e5, 0));
  const Acceptance acceptance(*far_away, 1e-6);
  EXPECT_NEAR(acceptance.least_mm(), 16 * 0x1p-52 * 2e5, 1e-14);
  EXPECT_EQ(acceptance.in_cell(LimitCellId{0}), acceptance.least_mm());
  EXPECT_EQ(acceptance.at(1e30 * Mat3::Identity()), acceptance.least_mm());
  EXPECT_EQ(Acceptance(*far_away, 1e-20).at(1e-30 * Mat3::Identity()), acceptance.least_mm());
}

}  // namespace
}  // namespace ccslice
