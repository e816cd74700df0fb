// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/triangle_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/core/distance/random_triangles.h"

namespace ccslice {
namespace {

TEST(TriangleTree, HoldsAllTrianglesAndNoOthers) {
  std::mt19937 random(3);
  for (const std::size_t count : {1u, 8u, 9u, 500u}) {
    const std::vector<FloatTriangle> triangles = random_triangles(random, count, 1);
    const TriangleTree tree(triangles);
    ASSERT_EQ(tree.group_count(), (count + 7) / 8);
    for (int round = 0; round < 20; ++round) {
      const Vec3 point = random_point(random, -2, 12);
      float squared = std::numeric_limits<float>::infinity();
      for (std::uint32_t group = 0; group < tree.group_count(); ++group) {
        const FloatLanes of_group = tree.group(group).squared_distances(in_all_lanes(to_float_point(point)));
        float least = of_group[0];
        for (std::size_t lane = 1; lane < kFloatLanes; ++lane) least = std::min(least, of_group[lane]);
        EXPECT_LE(tree.box(group).squared_distance(to_float_point(point)), least * 1.0001f + 1e-6f);
        squared = std::min(squared, least);
      }
      EXPECT_NEAR(std::sqrt(squared), exact_distance(triangles, point), 2e-5);
    }
  }
}

TEST(TriangleTree, FindsTheGroupsNearABox) {
  std::mt19937 random(4);
  const TriangleTree tree(random_triangles(random, 700, 0.5));
  for (int round = 0; round < 50; ++round) {
    const Vec3 low = random_point(random, -2, 12), high = low + random_point(random, 0, 2);
    const FloatBox box{to_float_point(low), to_float_point(high)};
    const float bound = static_cast<float>(round) / 20;
    std::vector<std::uint32_t> near;
    for (std::uint32_t group = 0; group < tree.group_count(); ++group) {
      if (tree.box(group).squared_distance(box) <= bound * bound) near.push_back(group);
    }
    EXPECT_EQ(tree.find_near(box, bound), near);
  }
}

TEST(TriangleTree, HasTheArea) {
  const FloatTriangle half_square = {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}};
  const TriangleTree tree({half_square, half_square, half_square});
  EXPECT_DOUBLE_EQ(tree.area_mm2(), 6);
  EXPECT_EQ(tree.box().max, (FloatPoint{2, 2, 0}));
}

}  // namespace
}  // namespace ccslice
