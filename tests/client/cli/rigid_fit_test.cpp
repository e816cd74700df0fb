// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/rigid_fit.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/client/cli/package_files.h"

namespace ccslice::cli {
namespace {

std::vector<Vec3> random_points(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> coordinate(-40, 60);
  std::vector<Vec3> points(count);
  for (Vec3& point : points) point = Vec3(coordinate(random), coordinate(random), coordinate(random));
  return points;
}

std::vector<Vec3> moved(const std::vector<Vec3>& points, const Placement& placement) {
  std::vector<Vec3> result;
  for (const Vec3& point : points) result.push_back(placement * point);
  return result;
}

TEST(RigidFit, FindsRandomMotionsAndMirrorings) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int round = 0; round < 200; ++round) {
    const std::vector<Vec3> points = random_points(4 + static_cast<std::size_t>(round), random);
    Placement placement = motion(Vec3(number(random), number(random), number(random)), 180 * number(random),
                                 500 * Vec3(number(random), number(random), number(random)));
    const bool mirrors = round % 2 == 1;
    if (mirrors) placement.linear().col(0) *= -1;
    const RigidFit fit = fit_rigid(points, moved(points, placement));
    EXPECT_LT(fit.residual_mm, 1e-10) << "seed " << kSeed << ", round " << round;
    EXPECT_TRUE(fit.placement.matrix().isApprox(placement.matrix(), 1e-10)) << round;
    EXPECT_EQ(fit.mirrors(), mirrors) << round;
  }
}

TEST(RigidFit, SaysHowFarWhichPointIsOff) {
  std::mt19937 random(3);
  const std::vector<Vec3> points = random_points(1000, random);
  std::vector<Vec3> to = moved(points, motion(Vec3(1, 2, 3), 40, Vec3(5, 6, 7)));
  to[123] += Vec3(0, 0, 0.5);
  const RigidFit fit = fit_rigid(points, to);
  EXPECT_NEAR(fit.residual_mm, 0.5, 0.01);
  EXPECT_EQ(fit.farthest, 123u);
}

TEST(RigidFit, TellsScalingFromEditing) {
  std::mt19937 random(5);
  const std::vector<Vec3> points = random_points(50, random);
  Placement placement = motion(Vec3(1, 2, 3), 40, Vec3(5, 6, 7));
  placement.linear() = placement.linear() * Vec3(1, 2, 0.5).asDiagonal();
  const ScaleFit scaled = fit_scale(points, moved(points, placement));
  EXPECT_LT(scaled.residual_mm, 1e-10);
  EXPECT_TRUE(scaled.factors.isApprox(Vec3(2, 1, 0.5), 1e-10));
  std::vector<Vec3> edited = points;
  edited[7].x() += 1;
  EXPECT_GT(fit_scale(points, edited).residual_mm, 0.5);
  EXPECT_EQ(fit_scale(std::vector<Vec3>{Vec3::Zero()}, std::vector<Vec3>{Vec3::Ones()}).residual_mm, 0);
}

TEST(RigidFit, SnapsTurnsByRightAnglesOnly) {
  const std::vector<Vec3> points = {Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(0, 10, 0), Vec3(0, 0, 10)};
  const Placement turned = motion(Vec3::UnitZ(), 90, Vec3(3, 4, 5));
  const Placement nearly = motion(Vec3(0.1, 0, 1), 1e-6, Vec3::Zero()) * turned;
  const Placement snapped = snapped_to_axes(nearly, points);
  EXPECT_EQ(snapped.linear()(0, 1), -1);
  EXPECT_EQ(snapped.linear()(0, 0), 0);
  EXPECT_FALSE(std::signbit(snapped.linear()(0, 0)));
  for (const Vec3& point : points) EXPECT_LT((snapped * point - turned * point).norm(), 1e-6);
  const Placement oblique = motion(Vec3::UnitZ(), 0.01, Vec3::Zero());
  EXPECT_EQ(snapped_to_axes(oblique, points).matrix(), oblique.matrix());
}

}  // namespace
}  // namespace ccslice::cli
