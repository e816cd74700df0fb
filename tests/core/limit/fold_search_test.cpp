// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/fold_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace ccslice {
namespace {

constexpr std::uint64_t kPlenty = 1'000'000;

/// Bezier coefficients of a cubic polynomial c0 + c1 t + c2 t^2 + c3 t^3.
std::array<double, 4> bezier_of(double c0, double c1, double c2, double c3) {
  return {c0, c0 + c1 / 3, c0 + 2 * c1 / 3 + c2 / 3, c0 + c1 + c2 + c3};
}

/// x = integral over u of |(u,v,w) - centre|^2 - sign(r) r^2, y = v, z = w: det J = |(u,v,w) - centre|^2 - sign(r) r^2.
/// A ball of radius r folds; with a negative r nothing does, by r^2.
BezierVolume patch_with_folded_ball(const Vec3& centre, double radius) {
  const std::array<double, 4> u = bezier_of(0, 1, 0, 0);
  const std::array<double, 4> cubic = bezier_of(0, centre[0] * centre[0], -centre[0], 1.0 / 3);
  const std::array<double, 4> v2 = bezier_of(centre[1] * centre[1], -2 * centre[1], 1, 0);
  const std::array<double, 4> w2 = bezier_of(centre[2] * centre[2], -2 * centre[2], 1, 0);
  BezierVolume net;
  for (std::size_t p = 0; p < 64; ++p) {
    const std::size_t i = p % 4, j = p / 4 % 4, k = p / 16;
    const double x = cubic[i] + u[i] * (v2[j] + w2[k] - std::copysign(radius * radius, radius));
    net[p] = {x, static_cast<double>(j) / 3, static_cast<double>(k) / 3, 0};
  }
  return net;
}

TEST(FoldSearch, FindsAFoldOfAFiftiethOfThePatchThatEightSamplesMiss) {
  const Vec3 centre(0.37, 0.61, 0.22);
  const auto to_quarter = [](double t) { return std::min(std::abs(t - 0.25), std::abs(t - 0.75)); };
  ASSERT_GT(centre.unaryExpr(to_quarter).norm(), 0.15);
  const FoldFinding found = FoldSearch(kPlenty).examine(patch_with_folded_ball(centre, 0.01));
  EXPECT_EQ(found.verdict, FoldVerdict::kFolds);
  EXPECT_LE(found.determinant, 0);
  EXPECT_GE(found.determinant, -1e-4 - 1e-12);
  EXPECT_LT((found.position.tail<2>() - centre.tail<2>()).norm(), 0.01);
}

TEST(FoldSearch, FindsFoldedBallsAnywhereAndClearsPatchesWithout) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0, 1), exponent(-1.6, -0.5);
  for (int i = 0; i < 300; ++i) {
    const Vec3 centre(place(random), place(random), place(random));
    const double radius = std::pow(10, exponent(random));
    EXPECT_EQ(FoldSearch(kPlenty).examine(patch_with_folded_ball(centre, radius)).verdict, FoldVerdict::kFolds) << i;
    EXPECT_EQ(FoldSearch(kPlenty).examine(patch_with_folded_ball(centre, -radius)).verdict, FoldVerdict::kUnfolded)
        << i;
  }
}

TEST(FoldSearch, NeverClearsAPatchWithAFoldTooSmallToSee) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> place(0, 1), exponent(-5, -2);
  for (int i = 0; i < 300; ++i) {
    const Vec3 centre(place(random), place(random), place(random));
    const FoldFinding found =
        FoldSearch(kPlenty).examine(patch_with_folded_ball(centre, std::pow(10, exponent(random))));
    EXPECT_NE(found.verdict, FoldVerdict::kUnfolded) << i;
  }
}

TEST(FoldSearch, IsUndecidedWhereTheDeterminantTouchesZero) {
  const FoldFinding found = FoldSearch(kPlenty).examine(patch_with_folded_ball({0.3, 0.4, 0.6}, 0));
  EXPECT_EQ(found.verdict, FoldVerdict::kUndecided);
  EXPECT_GT(found.determinant, 0);
}

TEST(FoldSearch, IsUndecidedWithoutWorkLeft) {
  FoldSearch search(FoldSearch::kSetUpHalvings + 1);
  EXPECT_EQ(search.examine(patch_with_folded_ball({0.37, 0.61, 0.22}, 0.01)).verdict, FoldVerdict::kUndecided);
  EXPECT_EQ(search.examine(patch_with_folded_ball({0.37, 0.61, 0.22}, 0.01)).verdict, FoldVerdict::kUndecided);
  EXPECT_EQ(search.examine(patch_with_folded_ball({0.37, 0.61, 0.22}, -10)).verdict, FoldVerdict::kUnfolded);
}

TEST(FoldSearch, ReportsDeterminantsOfTheWholePatch) {
  BezierVolume mirrored;
  for (std::size_t p = 0; p < 64; ++p) {
    mirrored[p] = {-2.0 * static_cast<double>(p % 4) / 3, static_cast<double>(p / 4 % 4) / 3,
                   static_cast<double>(p / 16) / 3, 0};
  }
  EXPECT_NEAR(FoldSearch(kPlenty).examine(mirrored).determinant, -2, 1e-12);
  EXPECT_NEAR(FoldSearch::sample(mirrored).determinant, -2, 1e-12);
}

}  // namespace
}  // namespace ccslice
