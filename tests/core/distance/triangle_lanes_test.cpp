// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/triangle_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/core/distance/random_triangles.h"

namespace ccslice {
namespace {

TEST(TriangleLanes, AreAsFarAsEachTriangle) {
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    const std::vector<FloatTriangle> triangles = random_triangles(random, kFloatLanes, round % 3 == 0 ? 0.02 : 3);
    TriangleLanes lanes;
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) lanes.set(lane, triangles[lane]);
    const Vec3 point = to_vec3(to_float_point(random_point(random, -2, 12)));
    const FloatLanes squared = lanes.squared_distances(in_all_lanes(to_float_point(point)));
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
      const Vec3 nearest = exact_nearest_place(triangles[lane], point);
      EXPECT_NEAR(std::sqrt(squared[lane]), (point - nearest).norm(), 2e-5);
      // Places that are as near may lie apart.
      EXPECT_NEAR((lanes.nearest_place(lane, point) - point).norm(), (point - nearest).norm(), 2e-5);
      const Vec3 place = lanes.nearest_place(lane, point);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto at = [&](std::size_t corner) { return triangles[lane][corner][static_cast<std::size_t>(axis)]; };
        EXPECT_GE(place[axis], std::min({at(0), at(1), at(2)}) - 2e-5);
        EXPECT_LE(place[axis], std::max({at(0), at(1), at(2)}) + 2e-5);
      }
    }
  }
}

TEST(TriangleLanes, KnowHowFarTheyReachAlongADirection) {
  std::mt19937 random(8);
  const std::vector<FloatTriangle> triangles = random_triangles(random, kFloatLanes, 3);
  TriangleLanes lanes;
  for (std::size_t lane = 0; lane < kFloatLanes; ++lane) lanes.set(lane, triangles[lane]);
  for (int round = 0; round < 50; ++round) {
    const Vec3 n = random_point(random, -1, 1).normalized();
    const FloatLanes most = lanes.most_along(to_float_point(n));
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
      const auto& [a, b, c] = triangles[lane];
      EXPECT_NEAR(most[lane], std::max({n.dot(to_vec3(a)), n.dot(to_vec3(b)), n.dot(to_vec3(c))}), 1e-5);
    }
  }
}

}  // namespace
}  // namespace ccslice
