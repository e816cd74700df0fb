// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_index.h"

#include <gtest/gtest.h>

#include "core/limit/boundary_surface.h"
#include "core/limit/support.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(ContourIndex, FindsEveryFaceWhoseHullThePlaneMeets) {
  const auto solid = prepare_solid(oracle::tiny_mesh("cross_of_seven"));
  const BoundarySurface surface(*solid);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const Placement placement = random_placement(random);
    const Vec3 normal = random_direction(random);
    const ContourIndex index(*solid, placement, normal);
    EXPECT_EQ(index.mirrored(), placement.linear().determinant() < 0);
    const Box3 box = bounding_box(*solid, placement);
    for (int plane = 0; plane < 20; ++plane) {
      const double height = normal.dot(box.min() + unit(random) * (box.max() - box.min()));
      std::vector<BoundaryFaceId> found, expected;
      index.faces_at(height, found);
      for (const BoundaryFaceId face : surface.face_ids()) {
        const Box3 hull = surface.hull_box(face);
        bool below = false, above = false;
        for (int corner = 0; corner < 8; ++corner) {
          const double h = normal.dot(placement * hull.corner(static_cast<Box3::CornerType>(corner))) - height;
          below |= h <= 0;
          above |= h >= 0;
        }
        if (below && above) expected.push_back(face);
      }
      EXPECT_EQ(found, expected);
    }
  }
}

TEST(ContourIndex, LiftsPlanesByAShareOfThePartsSize) {
  const auto solid = prepare_solid(oracle::tiny_mesh("box_3"));
  const double diagonal = bounding_box(*solid, Placement::Identity()).diagonal().norm();
  EXPECT_NEAR(ContourIndex(*solid, Placement::Identity(), Vec3::UnitZ()).lift_mm(), kPlaneLift * diagonal, 1e-20);
  // Far from the origin rounding grows with the coordinates, and so does the lift.
  Placement far_away = Placement::Identity();
  far_away.translation() = Vec3(1e6, 0, 0);
  EXPECT_GT(ContourIndex(*solid, far_away, Vec3::UnitZ()).lift_mm(), 1e-7);
  // A scale that is known is taken as it is.
  EXPECT_EQ(rounding_scale_mm(*solid, Placement::Identity()), diagonal);
  EXPECT_EQ(ContourIndex(*solid, Placement::Identity(), Vec3::UnitZ(), 7).lift_mm(), kPlaneLift * 7);
}

}  // namespace
}  // namespace ccslice
