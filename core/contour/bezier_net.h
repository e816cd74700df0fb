// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The control net of a bicubic Bezier patch, one array per coordinate, and the three things that contours and
// triangles need of it: halving by de Casteljau's algorithm, the sign bounds of the convex hull, and the chord bound.
//
// Chord bound: over the unit square a patch S differs from the linear interpolation between two points of a line, or
// three of a triangle, by at most (|S_ss| + 2 |S_st| + |S_tt|) / 8 [Filip, Magedson, Markot 1986]; second differences
// of the control net bound the second derivatives.

#pragma once

#include <array>
#include <cmath>

#include "core/base/types.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {

/// One coordinate of a net: coefficient [4 * row + column], column along s, row along t.
using NetCoefficients = std::array<double, 16>;

struct BezierNet {
  NetCoefficients x, y, z;  // mm. For contours: coordinates in the plane, and height above it.
};

/// One side of a net, or a cubic along it.
struct BezierCurve {
  std::array<double, 4> x, y, z;
};

/// p -> linear * p + offset.
struct AffineMap {
  Mat3 linear = Mat3::Identity();
  Vec3 offset = Vec3::Zero();

  Vec3 operator()(const Vec3& p) const { return linear * p + offset; }
  PaddedPoint padded(const PaddedPoint& p) const {
    const Vec3 mapped = linear * p.head<3>() + offset;
    return {mapped.x(), mapped.y(), mapped.z(), 0};
  }
};

BezierNet net_of(const BezierPatch& patch);
BezierNet transformed(const BezierPatch& patch, const AffineMap& map);

/// The nets over [i/2, (i+1)/2] x [j/2, (j+1)/2], at i + 2 j.
std::array<BezierNet, 4> quarters_of(const BezierNet& net);

struct CoefficientHull {
  double low, high;
};
/// The range of the coefficients: the net's values lie in it.
CoefficientHull hull_of(const NetCoefficients& net);
/// The bound above, in mm.
struct ChordBound {
  double ss = 0, st = 0, tt = 0;  // Bounds of |S_ss| / 8, |S_st| / 4, |S_tt| / 8.

  /// The bound for any line or triangle in the unit square.
  double whole() const { return ss + st + tt; }
  /// The bound for a line from p to p + (ds, dt) in the unit square.
  double along(double ds, double dt) const { return ss * ds * ds + st * std::abs(ds * dt) + tt * dt * dt; }
};
ChordBound chord_bound(const BezierNet& net);
/// Diagonal of the bounding box in x and y.
double diagonal_xy(const BezierNet& net);

/// The side from corner `side` to corner side + 1 (corners counter-clockwise from (0,0)), always along increasing s or
/// t.
BezierCurve side_curve(const BezierNet& net, int side);
void set_side_curve(BezierNet& net, int side, const BezierCurve& curve);

double evaluate(const std::array<double, 4>& cubic, double u);
/// The value at the middle of the unit square.
double evaluate_middle(const NetCoefficients& net);

/// The coefficients of corner 0-3 in a net: (0,0), (1,0), (1,1), (0,1).
inline constexpr std::array<int, 4> kNetCorner = {0, 3, 15, 12};

}  // namespace ccslice
