// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/lane_box.h"

#include <gtest/gtest.h>

#include <random>

namespace ccslice {
namespace {

constexpr double kPadding = 1e9;  // What pads points may be anything.

Lanes padded(const Vec3& point) { return to_lanes(point) + Lanes{0, 0, 0, kPadding}; }

TEST(LaneMap, IsTheMatrix) {
  constexpr unsigned kSeed = 20261126;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 100; ++n) {
    const Mat3 matrix = Mat3::NullaryExpr([&] { return unit(random); });
    const Vec3 point = Vec3::NullaryExpr([&] { return unit(random); });
    EXPECT_LT((to_vec3(LaneMap(matrix)(padded(point))) - matrix * point).norm(), 1e-15) << "seed " << kSeed;
  }
}

TEST(LaneBox, HoldsItsPointsAndNoMore) {
  LaneBox box;
  EXPECT_TRUE(box.box().isEmpty());
  for (const Vec3& point : {Vec3(1, 5, -2), Vec3(2, 4, -3), Vec3(1.5, 6, -2.5)}) box.extend(padded(point));
  EXPECT_EQ(box.box().min(), Vec3(1, 4, -3));
  EXPECT_EQ(box.box().max(), Vec3(2, 6, -2));
  LaneBox other;
  other.extend(padded(Vec3(0, 5, -1)));
  other.extend(box);
  other.extend(LaneBox());
  EXPECT_EQ(other.box().min(), Vec3(0, 4, -3));
  EXPECT_EQ(other.box().max(), Vec3(2, 6, -1));
}

}  // namespace
}  // namespace ccslice
