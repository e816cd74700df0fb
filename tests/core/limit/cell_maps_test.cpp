// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_maps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace ccslice {
namespace {

constexpr LimitCellId kCell{1};
constexpr std::uint32_t kMapsSeed = 20261127;

// Far from the origin of the mesh, too: what counts is how far from the solid's middle.
TEST(CellMaps, RoundMapsToFloatsAboutTheMiddleOfTheSolid) {
  std::mt19937 random(kMapsSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto random_vector = [&] { return Vec3(unit(random), unit(random), unit(random)); };
  for (const double far : {0.0, 9e5}) {
    CellMaps maps;
    maps.resize(3, Vec3::Constant(far));
    for (int i = 0; i < 100; ++i) {
      const Vec3 middle = Vec3::Constant(far) + 10 * random_vector();
      Mat3 inverse_jacobian;
      for (Eigen::Index a = 0; a < 3; ++a) inverse_jacobian.col(a) = random_vector();
      maps.set(kCell, middle, inverse_jacobian);
      EXPECT_LT((maps[kCell].middle - middle).norm(), 1e-6) << far;
      EXPECT_LT((maps[kCell].inverse_jacobian - inverse_jacobian).norm(), 1e-6);
      const Vec3 point = middle + 0.1 * random_vector();
      const Vec3 guess = Vec3::Constant(0.5) + inverse_jacobian * (point - middle);
      EXPECT_LT((maps[kCell](point) - guess).norm(), 4e-6);
    }
  }
}

TEST(CellMaps, KeepHullsThatHoldTheOnesThatWereSet) {
  std::mt19937 random(kMapsSeed);
  std::uniform_real_distribution<double> exponent(-20, 20);
  CellMaps maps;
  maps.resize(3, Vec3::Zero());
  for (int i = 0; i < 1000; ++i) {
    Box3 hull;
    for (int k = 0; k < 2; ++k) {
      Vec3 corner;
      for (double& x : corner) x = (random() % 2 == 0 ? 1 : -1) * std::exp2(exponent(random));
      hull.extend(corner);
    }
    maps.set_hull(kCell, hull);
    EXPECT_TRUE(maps[kCell].hull.contains(hull)) << "seed " << kMapsSeed;
    EXPECT_TRUE(hull.isApprox(maps[kCell].hull, 1e-6));
  }
}

TEST(CellMaps, HaveNoJacobianWhereItIsNoNumberOrBeyondFloats) {
  CellMaps maps;
  maps.resize(2, Vec3::Zero());
  for (const double entry : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e39}) {
    maps.set(kCell, Vec3::Ones(), Mat3::Constant(entry));
    EXPECT_EQ(maps[kCell].inverse_jacobian, Mat3::Zero());
    EXPECT_EQ(maps[kCell](Vec3(7, 8, 9)), Vec3::Constant(0.5));
    EXPECT_TRUE(std::isinf(maps[kCell].thickness_mm()));
  }
}

TEST(CellMaps, TakeSeventyTwoBytesACell) {
  CellMaps maps;
  maps.resize(1000, Vec3::Zero());
  EXPECT_EQ(maps.memory_bytes(), 72'000u);
}

}  // namespace
}  // namespace ccslice
