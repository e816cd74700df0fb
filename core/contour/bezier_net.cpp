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

}  // namespace

BezierNet transformed(const BezierPatch& patch, const AffineMap& map) {
  BezierNet net;
  for (int k = 0; k < 16; ++k) {
    const Vec3 p = map(patch.b[k]);
    net.x[k] = p.x();
    net.y[k] = p.y();
    net.z[k] = p.z();
  }
  return net;
}

void halve(const NetCoefficients& net, HalvedCoefficients& halves) {
  std::array<double, 28> rows;
  for (int j = 0; j < 4; ++j) halve_cubic(net[4 * j], net[4 * j + 1], net[4 * j + 2], net[4 * j + 3], &rows[7 * j], 1);
  for (int i = 0; i < 7; ++i) halve_cubic(rows[i], rows[7 + i], rows[14 + i], rows[21 + i], &halves[i], 7);
}

void take_quarter(const HalvedCoefficients& halves, int i, int j, NetCoefficients& quarter) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      quarter[4 * row + column] = halves[7 * (3 * j + row) + 3 * i + column];
    }
  }
}

bool straddles_zero(const NetCoefficients& z, double margin) {
  const Eigen::Map<const Eigen::Array<double, 16, 1>> heights(z.data());
  return heights.minCoeff() <= margin && heights.maxCoeff() >= -margin;
}

double chord_bound(const BezierNet& net) {
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
  return (6 * std::sqrt(ss) + 18 * std::sqrt(st) + 6 * std::sqrt(tt)) / 8;
}

double diagonal_xy(const BezierNet& net) {
  const auto [x_low, x_high] = std::minmax_element(net.x.begin(), net.x.end());
  const auto [y_low, y_high] = std::minmax_element(net.y.begin(), net.y.end());
  return std::hypot(*x_high - *x_low, *y_high - *y_low);
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
