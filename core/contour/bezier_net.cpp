// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/bezier_net.h"

#include <algorithm>
#include <cmath>

namespace ccslice {
namespace {

/// Writes the seven control points of both halves, `stride` apart. The same bits for the reversed curve.
void halve_cubic(double b0, double b1, double b2, double b3, double* out, int stride) {
  const double b01 = 0.5 * (b0 + b1), b12 = 0.5 * (b1 + b2), b23 = 0.5 * (b2 + b3);
  const double b012 = 0.5 * (b01 + b12), b123 = 0.5 * (b12 + b23);
  out[0] = b0;
  out[stride] = b01;
  out[2 * stride] = b012;
  out[3 * stride] = 0.5 * (b012 + b123);
  out[4 * stride] = b123;
  out[5 * stride] = b23;
  out[6 * stride] = b3;
}

double second_difference_squared(const BezierNet& net, int a, int b, int c) {
  const double x = net.x[a] - 2 * net.x[b] + net.x[c];
  const double y = net.y[a] - 2 * net.y[b] + net.y[c];
  const double z = net.z[a] - 2 * net.z[b] + net.z[c];
  return x * x + y * y + z * z;
}

double mixed_difference_squared(const BezierNet& net, int k) {
  const auto mixed = [k](const NetCoefficients& c) { return (c[k + 5] - c[k + 4]) - (c[k + 1] - c[k]); };
  const double x = mixed(net.x), y = mixed(net.y), z = mixed(net.z);
  return x * x + y * y + z * z;
}

/// Index in a net of point k of a side.
int side_index(int side, int k) {
  switch (side) {
    case 0: return k;
    case 1: return 4 * k + 3;
    case 2: return 12 + k;
    default: return 4 * k;
  }
}

/// One coordinate of a net halved in both directions: [7 * row + column]. Quarter (i,j) starts at column 3i, row 3j.
using HalvedCoefficients = std::array<double, 49>;

HalvedCoefficients halve(const NetCoefficients& net) {
  std::array<double, 28> rows;
  HalvedCoefficients halves;
  for (int j = 0; j < 4; ++j) halve_cubic(net[4 * j], net[4 * j + 1], net[4 * j + 2], net[4 * j + 3], &rows[7 * j], 1);
  for (int i = 0; i < 7; ++i) halve_cubic(rows[i], rows[7 + i], rows[14 + i], rows[21 + i], &halves[i], 7);
  return halves;
}

void take_quarter(const HalvedCoefficients& halves, int i, int j, NetCoefficients& quarter) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      quarter[4 * row + column] = halves[7 * (3 * j + row) + 3 * i + column];
    }
  }
}

}  // namespace

BezierNet net_of(const BezierPatch& patch) {
  BezierNet net;
  for (int k = 0; k < 16; ++k) {
    net.x[k] = patch.b[k].x();
    net.y[k] = patch.b[k].y();
    net.z[k] = patch.b[k].z();
  }
  return net;
}

BezierNet transformed(const BezierPatch& patch, const AffineMap& map) {
  BezierPatch mapped;
  for (int k = 0; k < 16; ++k) mapped.b[k] = map.padded(patch.b[k]);
  return net_of(mapped);
}

std::array<BezierNet, 4> quarters_of(const BezierNet& net) {
  std::array<BezierNet, 4> result;
  const auto split = [&](NetCoefficients BezierNet::*coordinate) {
    const HalvedCoefficients halves = halve(net.*coordinate);
    for (int quarter = 0; quarter < 4; ++quarter) {
      take_quarter(halves, quarter % 2, quarter / 2, result[static_cast<std::size_t>(quarter)].*coordinate);
    }
  };
  split(&BezierNet::x);
  split(&BezierNet::y);
  split(&BezierNet::z);
  return result;
}

CoefficientHull hull_of(const NetCoefficients& net) {
  const Eigen::Map<const Eigen::Array<double, 16, 1>> coefficients(net.data());
  return {coefficients.minCoeff(), coefficients.maxCoeff()};
}

/// A derivative of a Bezier polynomial has differences of its coefficients for coefficients, times the degree: S_ss has
/// 3 * 2 times the second differences, S_st 3 * 3 times the mixed ones. So |S_ss| / 8 and 2 |S_st| / 8 are at most 6/8
/// and 18/8 of the largest, and likewise |S_tt| / 8.
ChordBound chord_bound(const BezierNet& net) {
  double ss = 0, st = 0, tt = 0;
  for (int line = 0; line < 4; ++line) {
    for (int k = 0; k < 2; ++k) {
      const int along_s = 4 * line + k, along_t = line + 4 * k;
      ss = std::max(ss, second_difference_squared(net, along_s, along_s + 1, along_s + 2));
      tt = std::max(tt, second_difference_squared(net, along_t, along_t + 4, along_t + 8));
    }
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) st = std::max(st, mixed_difference_squared(net, 4 * row + column));
  }
  return {6 * std::sqrt(ss) / 8, 18 * std::sqrt(st) / 8, 6 * std::sqrt(tt) / 8};
}

double diagonal_xy(const BezierNet& net) {
  const CoefficientHull x = hull_of(net.x), y = hull_of(net.y);
  return std::hypot(x.high - x.low, y.high - y.low);
}

BezierCurve side_curve(const BezierNet& net, int side) {
  BezierCurve curve;
  for (int k = 0; k < 4; ++k) {
    const int at = side_index(side, k);
    curve.x[k] = net.x[at];
    curve.y[k] = net.y[at];
    curve.z[k] = net.z[at];
  }
  return curve;
}

void set_side_curve(BezierNet& net, int side, const BezierCurve& curve) {
  for (int k = 0; k < 4; ++k) {
    const int at = side_index(side, k);
    net.x[at] = curve.x[k];
    net.y[at] = curve.y[k];
    net.z[at] = curve.z[k];
  }
}

double evaluate(const std::array<double, 4>& cubic, double u) {
  const double v = 1 - u;
  const double b01 = v * cubic[0] + u * cubic[1], b12 = v * cubic[1] + u * cubic[2], b23 = v * cubic[2] + u * cubic[3];
  return v * (v * b01 + u * b12) + u * (v * b12 + u * b23);
}

double evaluate_middle(const NetCoefficients& net) {
  constexpr std::array<double, 4> kWeight = {0.125, 0.375, 0.375, 0.125};
  double sum = 0;
  for (int k = 0; k < 16; ++k) sum += kWeight[k / 4] * kWeight[k % 4] * net[k];
  return sum;
}

}  // namespace ccslice
