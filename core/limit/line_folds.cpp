// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/line_folds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"

namespace ccslice {
namespace {

constexpr std::uint8_t kOuterChild = 3;  // Off both axes.
constexpr double kRounding = 1e-9;       // Of the product of the three vectors' lengths, with room.

template <std::size_t kCount>
using Polynomial = std::array<double, kCount>;  // Bernstein coefficients.
using Curve = std::array<Vec3, 4>;              // Likewise.

/// Cubic B-spline coefficients -> Bernstein coefficients.
Curve to_bernstein(const Curve& k) {
  return {(k[0] + 4 * k[1] + k[2]) / 6, (2 * k[1] + k[2]) / 3, (k[1] + 2 * k[2]) / 3, (k[1] + 4 * k[2] + k[3]) / 6};
}

/// det(a, b, c') for cubics a, b, c.
Polynomial<9> determinant(const Curve& a, const Curve& b, const Curve& c) {
  constexpr Polynomial<4> kCubic = {1, 3, 3, 1};
  constexpr Polynomial<3> kQuadratic = {1, 2, 1};
  constexpr Polynomial<9> kOctic = {1, 8, 28, 56, 70, 56, 28, 8, 1};
  std::array<Vec3, 7> cross;
  cross.fill(Vec3::Zero());
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) cross[i + j] += kCubic[i] * kCubic[j] * a[i].cross(b[j]);
  }
  Polynomial<9> result{};
  for (std::size_t i = 0; i < 7; ++i) {
    for (std::size_t j = 0; j < 3; ++j) result[i + j] += kQuadratic[j] * cross[i].dot(3 * (c[j + 1] - c[j]));
  }
  for (std::size_t i = 0; i < 9; ++i) result[i] /= kOctic[i];
  return result;
}

double longest(const Curve& curve) {
  double square = 0;
  for (const Vec3& v : curve) square = std::max(square, v.squaredNorm());
  return std::sqrt(square);
}

Vec3 value_at(Curve curve, double t) {
  for (std::size_t count = 3; count > 0; --count) {
    for (std::size_t i = 0; i < count; ++i) curve[i] += t * (curve[i + 1] - curve[i]);
  }
  return curve[0];
}

/// A piece [low, low + size] of the line, and the determinant there.
struct Piece {
  Polynomial<9> b;
  double low = 0, size = 1;
};

Piece halve(Piece& piece) {
  Piece upper = piece;
  for (std::size_t round = 0; round < 9; ++round) {
    piece.b[round] = upper.b[0];
    for (std::size_t i = 0; i + round < 8; ++i) upper.b[i] = 0.5 * (upper.b[i] + upper.b[i + 1]);
  }
  piece.size = upper.size = piece.size / 2;
  upper.low = piece.low + piece.size;
  return upper;
}

struct Least {
  FoldVerdict verdict = FoldVerdict::kUnfolded;
  double value = 0;
  double w = 0;
};

/// The smallest value met, and the sign of all, as far as it is beyond `rounding`.
Least least_of(const Polynomial<9>& polynomial, double rounding) {
  Least least{FoldVerdict::kUnfolded, polynomial[0], 0};
  std::vector<Piece> pieces = {{polynomial}};
  while (!pieces.empty()) {
    Piece piece = pieces.back();
    pieces.pop_back();
    for (const auto& [value, w] : {std::pair(piece.b.front(), piece.low), {piece.b.back(), piece.low + piece.size}}) {
      if (value < least.value) least.value = value, least.w = w;
    }
    if (least.value < -rounding) return least.verdict = FoldVerdict::kFolds, least;
    if (*std::min_element(piece.b.begin(), piece.b.end()) > rounding) continue;
    if (piece.size * LineFolds::kFinest <= 1) {
      least.verdict = FoldVerdict::kUndecided;
      continue;
    }
    pieces.push_back(halve(piece));
    pieces.push_back(piece);
  }
  return least;
}

}  // namespace

/// Subdivides the unit vectors of the ring's points.
const LineFolds::Rows& LineFolds::rows(std::uint32_t op) {
  Rows& rows = rows_[op];
  if (rows.rows() > 0) return rows;
  const auto& lines = data_.operators.lines();
  const std::size_t dimension = lines[op].points;
  std::vector<double> ring(dimension * dimension, 0.0), next;
  for (std::size_t i = 0; i < dimension; ++i) ring[i * dimension + i] = 1;
  const auto step = [&](const PlanarOperator& now, const ChildRows& child) {
    next.assign(child.count * dimension, 0.0);
    now.stencils.apply(child.first_row, child.count, ring.data(), dimension, next.data());
    ring.swap(next);
  };
  std::uint32_t at = op;
  for (int level = 0; level < kLevels; ++level) {
    const ChildRows& inner = lines[at].children[0];
    step(lines[at], inner);
    at = inner.op;
  }
  const ChildRows& outer = lines[at].children[kOuterChild];
  step(lines[at], outer);
  fill_phantoms(ring.data(), 2, dimension, outer.phantoms);
  std::array<double, 4> value, slope;
  bspline_basis(0.5, value, slope);
  rows.setZero(static_cast<Eigen::Index>(dimension), 3);
  for (std::size_t p = 0; p < 16; ++p) {
    const Eigen::Map<const Eigen::VectorXd> weights(ring.data() + p * dimension, rows.rows());
    const std::size_t i = p % 4, j = p / 4;
    rows.col(0) += value[i] * value[j] * weights;
    rows.col(1) += std::ldexp(slope[i] * value[j], kLevels + 1) * weights;
    rows.col(2) += std::ldexp(value[i] * slope[j], kLevels + 1) * weights;
  }
  return rows;
}

FoldFinding LineFolds::examine(std::uint32_t op, std::span<const double> layers) {
  const Rows& weights = rows(op);
  const auto points = static_cast<std::size_t>(weights.rows());
  const Vec3 origin = Vec3::Map(layers.data());  // Derivatives are small beside coordinates.
  std::array<Curve, 3> curves;                   // Position, d/du, d/dv.
  for (std::size_t layer = 0; layer < 4; ++layer) {
    Mat3 sums = Mat3::Zero();
    for (std::size_t p = 0; p < points; ++p) {
      const Vec3 point = Vec3::Map(layers.data() + kPositionDimension * (layer * points + p)) - origin;
      sums += point * weights.row(static_cast<Eigen::Index>(p));
    }
    for (std::size_t c = 0; c < 3; ++c) curves[c][layer] = sums.col(static_cast<Eigen::Index>(c));
  }
  for (Curve& curve : curves) curve = to_bernstein(curve);
  const auto& [position, along_u, along_v] = curves;
  const Polynomial<9> polynomial = determinant(along_u, along_v, position);
  Curve steps;
  for (std::size_t i = 0; i < 3; ++i) steps[i] = 3 * (position[i + 1] - position[i]);
  steps[3] = steps[2];
  const Least least = least_of(polynomial, kRounding * longest(along_u) * longest(along_v) * longest(steps));
  return {least.verdict, least.value, origin + value_at(position, least.w)};
}

}  // namespace ccslice
