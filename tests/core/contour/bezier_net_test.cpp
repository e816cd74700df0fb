// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/bezier_net.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace ccslice {
namespace {

BezierNet random_net(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  BezierNet net;
  for (int k = 0; k < 16; ++k) {
    net.x[k] = k % 4 + unit(random);
    net.y[k] = k / 4 + unit(random);
    net.z[k] = unit(random);
  }
  return net;
}

double evaluate_net(const NetCoefficients& net, double s, double t) {
  std::array<double, 4> column;
  for (int row = 0; row < 4; ++row) {
    column[row] = evaluate({net[4 * row], net[4 * row + 1], net[4 * row + 2], net[4 * row + 3]}, s);
  }
  return evaluate(column, t);
}

Vec3 evaluate_net(const BezierNet& net, double s, double t) {
  return {evaluate_net(net.x, s, t), evaluate_net(net.y, s, t), evaluate_net(net.z, s, t)};
}

TEST(BezierNet, QuartersAreTheSamePatch) {
  std::mt19937 random(1);
  const BezierNet net = random_net(random);
  const std::array<BezierNet, 4> quarters = quarters_of(net);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const int i = quarter % 2, j = quarter / 2;
    const BezierNet& child = quarters[static_cast<std::size_t>(quarter)];
    for (const double s : {0.0, 0.3, 1.0}) {
      for (const double t : {0.0, 0.6, 1.0}) {
        EXPECT_LT((evaluate_net(child, s, t) - evaluate_net(net, (i + s) / 2, (j + t) / 2)).norm(), 3e-14);
      }
    }
  }
}

TEST(BezierNet, SidesAreTheSidesOfThePatch) {
  std::mt19937 random(2);
  BezierNet net = random_net(random);
  for (const double u : {0.0, 0.2, 0.7, 1.0}) {
    EXPECT_NEAR(evaluate(side_curve(net, 0).x, u), evaluate_net(net.x, u, 0), 1e-14);
    EXPECT_NEAR(evaluate(side_curve(net, 1).y, u), evaluate_net(net.y, 1, u), 1e-14);
    EXPECT_NEAR(evaluate(side_curve(net, 2).z, u), evaluate_net(net.z, u, 1), 1e-14);
    EXPECT_NEAR(evaluate(side_curve(net, 3).x, u), evaluate_net(net.x, 0, u), 1e-14);
  }
  EXPECT_NEAR(evaluate_middle(net.z), evaluate_net(net.z, 0.5, 0.5), 1e-14);
  const BezierNet before = net;
  for (int side = 0; side < 4; ++side) set_side_curve(net, side, side_curve(net, side));
  EXPECT_EQ(net.x, before.x);
  EXPECT_EQ(net.z, before.z);
}

TEST(BezierNet, TheChordBoundBoundsChords) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const BezierNet net = random_net(random);
    const ChordBound bound = chord_bound(net);
    for (int chord = 0; chord < 20; ++chord) {
      const double s0 = unit(random), t0 = unit(random), s1 = unit(random), t1 = unit(random), u = unit(random);
      const Vec3 between = (1 - u) * evaluate_net(net, s0, t0) + u * evaluate_net(net, s1, t1);
      const double error = (between - evaluate_net(net, (1 - u) * s0 + u * s1, (1 - u) * t0 + u * t1)).norm();
      EXPECT_LE(error, bound.along(s1 - s0, t1 - t0));
      EXPECT_LE(bound.along(s1 - s0, t1 - t0), bound.whole());
    }
  }
}

TEST(BezierNet, AParallelogramHasNoChordError) {
  BezierPatch patch;
  for (int k = 0; k < 16; ++k) patch.b[k] = PaddedPoint(k % 4, 2 * (k % 4) - k / 4, 3 * (k / 4), 0);
  EXPECT_NEAR(chord_bound(transformed(patch, {})).whole(), 0, 1e-14);
}

TEST(BezierNet, TheHullHoldsTheValues) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  const BezierNet net = random_net(random);
  const CoefficientHull hull = hull_of(net.z);
  EXPECT_EQ(hull.low, *std::min_element(net.z.begin(), net.z.end()));
  EXPECT_EQ(hull.high, *std::max_element(net.z.begin(), net.z.end()));
  for (int trial = 0; trial < 100; ++trial) {
    const double value = evaluate_net(net.z, unit(random), unit(random));
    EXPECT_LE(hull.low, value);
    EXPECT_GE(hull.high, value);
  }
}

}  // namespace
}  // namespace ccslice
