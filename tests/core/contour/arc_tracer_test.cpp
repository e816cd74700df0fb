// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/arc_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace ccslice {
namespace {

/// S(s,t) = (s, t, t - s^2 / 2 + s / 4), with s and t exchanged if `across_s`: level lines are parabolas.
BezierNet parabolic(bool across_s) {
  BezierNet net;
  for (int k = 0; k < 16; ++k) {
    const double row = (k / 4) / 3.0, column = (k % 4) / 3.0;
    const double a = across_s ? row : column, b = across_s ? column : row;
    const double blossom = std::max(0.0, 3 * a * (3 * a - 1) / 6);  // Of a^2 as a cubic: 0, 0, 1/3, 1.
    net.x[k] = across_s ? b : a;
    net.y[k] = across_s ? a : b;
    net.z[k] = b - 0.5 * blossom + 0.25 * a;
  }
  return net;
}

double parabola(double a, double height) { return height + 0.5 * a * a - 0.25 * a; }

TEST(ArcTracer, FollowsALevelLineInTheFewestStepsThatTheToleranceAllows) {
  for (const bool across_s : {false, true}) {
    const BezierNet net = parabolic(across_s);
    SurfaceNode node;
    node.level_lines = across_s ? LevelLines::kAcrossS : LevelLines::kAcrossT;
    node.chord = chord_bound(net);
    ArcTracer tracer;
    const double height = 0.3;
    const auto point = [&](double a) {
      const double b = parabola(a, height);
      return across_s ? ArcPoint{b, a, {b, a}} : ArcPoint{a, b, {a, b}};
    };
    for (const double tolerance : {1.0, 1e-2, 1e-4, 1e-6}) {
      const auto arc = tracer.trace({node, net}, height, point(0), point(1), tolerance);
      // |S_aa| = 1 along the height only.
      EXPECT_NEAR(static_cast<double>(arc.size()), 1 + std::ceil(std::sqrt(0.125 / tolerance)), 1);
      for (std::size_t k = 0; k < arc.size(); ++k) {
        const double a = across_s ? arc[k].t : arc[k].s, b = across_s ? arc[k].s : arc[k].t;
        EXPECT_NEAR(b, parabola(a, height), 1e-14);
        EXPECT_NEAR(arc[k].xy.x(), arc[k].s, 1e-14);
        EXPECT_NEAR(arc[k].xy.y(), arc[k].t, 1e-14);
        if (k > 0) {
          EXPECT_LE(node.chord.along(arc[k].s - arc[k - 1].s, arc[k].t - arc[k - 1].t), tolerance);
        }
      }
    }
  }
}

/// De Casteljau's algorithm.
double cubic_at(double b0, double b1, double b2, double b3, double u) {
  const auto mix = [u](double a, double b) { return a + u * (b - a); };
  return mix(mix(mix(b0, b1), mix(b1, b2)), mix(mix(b1, b2), mix(b2, b3)));
}

double value_at(const NetCoefficients& c, double s, double t) {
  const auto row = [&](int j) { return cubic_at(c[4 * j], c[4 * j + 1], c[4 * j + 2], c[4 * j + 3], s); };
  return cubic_at(row(0), row(1), row(2), row(3), t);
}

/// A random patch whose height rises strictly along t or, exchanged, along s.
BezierNet random_graph(bool across_s, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  BezierNet net;
  for (int a = 0; a < 4; ++a) {
    double z = 2 * unit(random);
    for (int b = 0; b < 4; ++b) {
      const int k = across_s ? b + 4 * a : a + 4 * b;
      net.x[k] = k % 4 + 0.5 * unit(random);
      net.y[k] = k / 4 + 0.5 * unit(random);
      net.z[k] = z;
      z += 0.05 + unit(random);
    }
  }
  return net;
}

/// The place of a patch at a height, by bisection along the parameter in which it rises.
ArcPoint place_at(const BezierNet& net, bool across_s, double a, double height) {
  double low = 0, high = 1;
  const auto point = [&](double b) { return across_s ? ArcPoint{b, a} : ArcPoint{a, b}; };
  for (int step = 0; step < 60; ++step) {
    const ArcPoint middle = point(0.5 * (low + high));
    (value_at(net.z, middle.s, middle.t) > height ? high : low) = 0.5 * (low + high);
  }
  ArcPoint found = point(low);
  found.xy = {value_at(net.x, found.s, found.t), value_at(net.y, found.s, found.t)};
  return found;
}

/// Of points of the chord between two points, at a height, from the surface over the line between their parameters.
double distance(const BezierNet& net, double height, const ArcPoint& from, const ArcPoint& to) {
  double most = 0;
  for (double w = 0; w <= 1; w += 0.125) {
    const double s = from.s + w * (to.s - from.s), t = from.t + w * (to.t - from.t);
    const Vec2 xy = from.xy + w * (to.xy - from.xy);
    const Vec3 off(value_at(net.x, s, t) - xy.x(), value_at(net.y, s, t) - xy.y(), value_at(net.z, s, t) - height);
    most = std::max(most, off.norm());
  }
  return most;
}

TEST(ArcTracer, ChordsOfRandomLevelLinesAreWithinTheToleranceOfTheSurface) {
  constexpr std::uint32_t kSeed = 20261123;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  ArcTracer tracer;
  int traced = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool across_s = trial % 2 == 0;
    const BezierNet net = random_graph(across_s, random);
    SurfaceNode node;
    node.level_lines = across_s ? LevelLines::kAcrossS : LevelLines::kAcrossT;
    node.chord = chord_bound(net);
    const double height = value_at(net.z, 0.5, 0.5), tolerance = std::pow(10.0, -1 - 3 * unit(random));
    double begin = unit(random), end = unit(random);
    const auto is_inside = [&](double a) {
      const ArcPoint low = across_s ? ArcPoint{0, a} : ArcPoint{a, 0},
                     high = across_s ? ArcPoint{1, a} : ArcPoint{a, 1};
      return value_at(net.z, low.s, low.t) < height && value_at(net.z, high.s, high.t) > height;
    };
    bool inside = true;
    for (int k = 0; k <= 100; ++k) inside = inside && is_inside(begin + 0.01 * k * (end - begin));
    if (!inside) continue;
    ++traced;
    const ArcPoint from = place_at(net, across_s, begin, height), to = place_at(net, across_s, end, height);
    const auto arc = tracer.trace({node, net}, height, from, to, tolerance);
    ASSERT_EQ(arc.front().xy, from.xy);
    ASSERT_EQ(arc.back().xy, to.xy);
    for (std::size_t k = 1; k < arc.size(); ++k) {
      const double before = across_s ? arc[k - 1].t : arc[k - 1].s, here = across_s ? arc[k].t : arc[k].s;
      EXPECT_GT((here - before) * (end - begin), 0);
      EXPECT_NEAR(value_at(net.z, arc[k].s, arc[k].t), height, 1e-12);
      EXPECT_NEAR(arc[k].xy.x(), value_at(net.x, arc[k].s, arc[k].t), 1e-12);
      EXPECT_NEAR(arc[k].xy.y(), value_at(net.y, arc[k].s, arc[k].t), 1e-12);
      ASSERT_LE(distance(net, height, arc[k - 1], arc[k]), tolerance) << "seed " << kSeed << ", trial " << trial;
    }
  }
  EXPECT_GT(traced, 100);
}

// Of a plane: no more than its ends, and along the longer one of two parameters.
TEST(ArcTracer, FollowsAStraightLineInOneStep) {
  BezierNet net;
  for (int k = 0; k < 16; ++k) {
    net.x[k] = k % 4;
    net.y[k] = k / 4;
    net.z[k] = k % 4 + k / 4;
  }
  SurfaceNode node;
  node.level_lines = LevelLines::kAcrossST;
  node.chord = chord_bound(net);
  ArcTracer tracer;
  EXPECT_EQ(tracer.trace({node, net}, 3, {0, 1, {0, 3}}, {1, 0, {3, 0}}, 1e-9).size(), 2u);
}

}  // namespace
}  // namespace ccslice
