// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/solid_angle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/brute_force.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

TEST(SolidAngle, OfAnOctantIsAnEighthOfTheSphere) {
  const Vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1), origin = Vec3::Zero();
  EXPECT_NEAR(solid_angle(origin, x, y, z), std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(solid_angle(origin, x, z, y), -std::numbers::pi / 2, 1e-12);
}

TEST(SolidAngle, WindsOnceRoundPointsInsideALimitSurface) {
  const BruteMesh mesh = to_brute_mesh(box_mesh(3, 2, 2));
  const BfrSurface surface(mesh, build_topology(mesh.cells, mesh.vertex_count()));
  const SurfaceWinding winding(surface, 32);
  const NearestOnSurface nearest(surface, 8);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> x(-2, 32), yz(-2, 22);
  const Vec3 middle(15, 10, 10);
  std::size_t inside = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3 point(x(random), yz(random), yz(random));
    if (nearest.distance(point) < 0.01) continue;
    const double number = winding.number_at(point);
    EXPECT_NEAR(number, std::round(number), 0.05) << point.transpose();
    // The solid is convex, so what is farther from the middle on the same ray is outside if the point is.
    inside += std::round(number) == 1;
    if (std::round(number) == 1) {
      EXPECT_EQ(std::round(winding.number_at(middle + 0.5 * (point - middle))), 1);
    } else {
      EXPECT_EQ(std::round(winding.number_at(middle + 1.5 * (point - middle))), 0);
    }
  }
  EXPECT_GT(inside, 50u);
}

}  // namespace
}  // namespace ccslice::oracle
