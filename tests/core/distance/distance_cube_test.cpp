// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/distance_cube.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "tests/core/distance/random_triangles.h"

namespace ccslice {
namespace {

constexpr double kRoundingMm = 2e-5;

std::vector<std::uint32_t> all_groups(const TriangleTree& tree) {
  std::vector<std::uint32_t> groups(tree.group_count());
  std::iota(groups.begin(), groups.end(), 0u);
  return groups;
}

double distance_of(const TriangleTree& tree, const std::vector<std::uint32_t>& groups, const Vec3& point) {
  return (nearest_place(tree, groups, point) - point).norm();
}

std::uint32_t nearest_group(const TriangleTree& tree, const Vec3& point) {
  const std::vector<std::uint32_t> groups = all_groups(tree);
  return *std::ranges::min_element(groups, {}, [&](std::uint32_t group) { return distance_of(tree, {group}, point); });
}

TEST(DistanceCube, HasEightChildren) {
  const DistanceCube cube{Vec3(1, 2, 3), 2};
  EXPECT_EQ(cube.child(0).middle, Vec3(0, 1, 2));
  EXPECT_EQ(cube.child(6).middle, Vec3(0, 3, 4));
  EXPECT_EQ(cube.child(6).half, 1);
  EXPECT_EQ(cube.box().min, (FloatPoint{-1, 0, 1}));
  EXPECT_EQ(cube.box().max, (FloatPoint{3, 4, 5}));
  EXPECT_DOUBLE_EQ(cube.radius(), (cube.child(7).middle - cube.child(0).middle).norm());
}

/// Whatever the place in a cube, the nearest of the groups that are kept is the nearest of all; and few are kept.
TEST(DistanceCube, KeepsWhatMayBeNearest) {
  std::mt19937 random(11);
  std::size_t kept_in_all = 0, in_all = 0;
  for (int round = 0; round < 60; ++round) {
    const TriangleTree tree(random_triangles(random, 400, 0.4));
    const std::vector<std::uint32_t> all = all_groups(tree);
    const DistanceCube cube{random_point(random, 0, 10), 0.02 * (1 + round)};
    for (const bool by_triangles : {false, true}) {
      const std::vector<std::uint32_t> kept =
          nearest_somewhere(tree, cube, all, nearest_group(tree, cube.middle), by_triangles, kRoundingMm);
      if (by_triangles) kept_in_all += kept.size(), in_all += all.size();
      for (int k = 0; k < 30; ++k) {
        const Vec3 point = cube.middle + cube.half * random_point(random, -1, 1);
        ASSERT_NEAR(distance_of(tree, kept, point), distance_of(tree, all, point), kRoundingMm) << round;
      }
    }
  }
  EXPECT_LT(kept_in_all, in_all / 3);
}

TEST(DistanceCube, HasASlabThatHoldsEverywhereInIt) {
  std::mt19937 random(12);
  for (int round = 0; round < 60; ++round) {
    const TriangleTree tree(random_triangles(random, 300, 0.6));
    const DistanceCube cube{random_point(random, 0, 10), 0.01 * (1 + round)};
    const std::vector<std::uint32_t> all = all_groups(tree);
    const std::vector<std::uint32_t> kept =
        nearest_somewhere(tree, cube, all, nearest_group(tree, cube.middle), true, kRoundingMm);
    const DistanceSlab slab = slab_of(tree, cube, kept, kRoundingMm);
    EXPECT_NEAR(to_vec3(slab.n).norm(), 1, 1e-6);
    for (int k = 0; k < 100; ++k) {
      const Vec3 point = cube.middle + cube.half * random_point(random, -1, 1);
      const double difference = to_vec3(slab.n).dot(point) - distance_of(tree, all, point);
      ASSERT_GE(difference, slab.least - kRoundingMm);
      ASSERT_LE(difference, slab.most + kRoundingMm);
    }
  }
}

/// Above the middle of a large triangle the distance is n x.
TEST(DistanceCube, HasAThinSlabOverAPlane) {
  const TriangleTree tree({FloatTriangle{{{-50, -50, 0}, {50, -50, 0}, {0, 50, 0}}}});
  const DistanceSlab slab = slab_of(tree, {Vec3(0, 0, 2), 0.2}, all_groups(tree), kRoundingMm);
  EXPECT_NEAR(slab.n[2], 1, 1e-6);
  EXPECT_NEAR(slab.most, 0, 1e-4);
  EXPECT_GT(slab.least, -0.02);
}

}  // namespace
}  // namespace ccslice
