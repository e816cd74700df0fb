// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/arc_tracer.h"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace ccslice
