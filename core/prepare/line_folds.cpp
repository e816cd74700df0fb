// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/line_folds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/lane_box.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"

namespace ccslice {
namespace {

constexpr double kProductRounding = 1e-12;  // As a share of the product of the three vectors' lengths, with room.

/// Where to look, in the parameters of one of the three patches of a level.
struct Place {
  std::uint8_t child;
  double u, v;
};
// The first one will do where one place shows all. The others go from the face v = 0 to the face u = 0. In the level's
// own u and v they are (1, 0), (1, 1/2), (1, 1), (1/2, 1) and (0, 1).
constexpr std::array<Place, 6> kPlaces = {{{3, 0.5, 0.5}, {1, 1, 0}, {3, 1, 0}, {3, 1, 1}, {3, 0, 1}, {2, 0, 1}}};

// The line itself, and d/du and d/dv at each place, at two levels at most.
constexpr std::size_t kMostCurves = 1 + 2 * 2 * kPlaces.size();

enum class LineKind { kInside, kSmooth, kSharp };

/// Across the line a sharp edge stays where it is, and a smooth one follows three points of the boundary.
LineKind kind_of(const PlanarOperator& line) {
  const auto weighs = [](double weight) { return std::abs(weight) > kProductRounding; };
  const auto count = std::count_if(line.limit.begin(), line.limit.end(), weighs);
  return count == 1 ? LineKind::kSharp : count == 3 ? LineKind::kSmooth : LineKind::kInside;
}

using Ring = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;  // Row p: weights in its point p.

Eigen::RowVectorXd limit_of(const PlanarOperator& line, const Ring& ring) {
  return Eigen::Map<const Eigen::RowVectorXd>(line.limit.data(), static_cast<Eigen::Index>(line.points)) * ring;
}

Ring child_of(const PlanarOperator& line, std::size_t child, const Ring& ring) {
  const ChildRows& rows = line.children[child];
  Ring next(rows.count, ring.cols());
  line.stencils.apply(line.rows_of(rows), ring.data(), static_cast<std::size_t>(ring.cols()), next.data());
  return next;
}

template <std::size_t kCount>
using Polynomial = std::array<double, kCount>;  // Bernstein coefficients.
using Curve = std::array<Vec3, 4>;              // Bernstein coefficients of a cubic.

/// Cubic B-spline coefficients -> Bernstein coefficients.
Curve to_bernstein(const Curve& k) {
  return {(k[0] + 4 * k[1] + k[2]) / 6, (2 * k[1] + k[2]) / 3, (k[1] + 2 * k[2]) / 3, (k[1] + 4 * k[2] + k[3]) / 6};
}

/// det(a, b, c') for cubics a, b, c. Bernstein coefficients times their binomials multiply like those of powers: they
/// are convolved, and divided by the binomials of degree 3 + 3 + 2 = 8.
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

/// Appends the weights in d/du and d/dv at a place beside the line. `ring`: less the limit, doubled at every level.
void append_view(const PlanarOperator& line, const Ring& ring, const Place& place, Eigen::MatrixXd& views) {
  Ring grid = child_of(line, place.child, ring);
  fill_phantoms(grid.data(), 2, static_cast<std::size_t>(grid.cols()), line.children[place.child].phantoms);
  std::array<double, 4> value_u, slope_u, value_v, slope_v;
  bspline_basis(place.u, value_u, slope_u);
  bspline_basis(place.v, value_v, slope_v);
  const Eigen::Index column = views.cols();
  views.conservativeResize(Eigen::NoChange, column + 2);
  views.rightCols<2>().setZero();
  for (std::size_t p = 0; p < 16; ++p) {
    const std::size_t i = p % 4, j = p / 4;
    // The patch covers half of the level along each axis: d/du of the level is twice that of the patch.
    const Eigen::VectorXd weights = 2 * grid.row(static_cast<Eigen::Index>(p));
    views.col(column) += slope_u[i] * value_v[j] * weights;
    views.col(column + 1) += value_u[i] * slope_v[j] * weights;
  }
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

/// The smallest value met, and the sign of all, as far as it is beyond `rounding`. A piece's first and last
/// coefficients are values, and all of them bound it. Halving brings them nearer to the values.
Least least_of(const Polynomial<9>& polynomial, double rounding) {
  Least least{FoldVerdict::kUnfolded, polynomial[0], 0};
  if (*std::min_element(polynomial.begin(), polynomial.end()) > rounding) {  // As nearly everywhere.
    if (polynomial.back() < least.value) least = {FoldVerdict::kUnfolded, polynomial.back(), 1};
    return least;
  }
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

bool LineFolds::is_sharp(std::uint32_t op) const { return kind_of(data_.operators.lines()[op]) == LineKind::kSharp; }

/// Subdivides the unit vectors of the ring's points.
const LineFolds::Weights& LineFolds::weights_of(std::uint32_t op) {
  Weights& weights = weights_[op];
  if (weights.cols() > 0) return weights;
  const auto& lines = data_.operators.lines();
  const auto points = static_cast<Eigen::Index>(lines[op].points);
  const LineKind kind = kind_of(lines[op]);
  const int last_level = kind == LineKind::kInside ? kLevels : kLastLevels;
  Ring ring = Ring::Identity(points, points);
  weights = limit_of(lines[op], ring).transpose();
  std::uint32_t at = op;
  for (int level = 0;; ++level) {
    // After the first time this takes off rounding only, which doubling would let grow. Points are doubled at each
    // level, as its parameters are: so derivatives by these stay those by the cell's.
    ring.rowwise() -= limit_of(lines[at], ring);
    if (level == kLevels || level == last_level) {
      for (std::size_t i = 0; i < (kind == LineKind::kSharp ? kPlaces.size() : 1); ++i) {
        append_view(lines[at], ring, kPlaces[i], weights);
      }
    }
    if (level == last_level) return weights;
    ring = 2 * child_of(lines[at], 0, ring);
    at = lines[at].children[0].op;
  }
}

FoldFinding LineFolds::examine(std::uint32_t op, std::span<const double> layers, Views views) {
  const Weights& all = weights_of(op);
  const Eigen::Index points = all.rows();
  const Lanes padded_origin = load_unaligned(layers.data());
  const Vec3 origin = to_vec3(padded_origin);  // Derivatives are small beside coordinates.
  // Position, then d/du and d/dv by view.
  std::array<Curve, kMostCurves> found;
  const auto curves = std::span(found).first(views == Views::kAll ? static_cast<std::size_t>(all.cols()) : 3);
  // Weights of the position add up to 1 and those of derivatives to 0: so only positions know of the origin.
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const double* weights = all.col(static_cast<Eigen::Index>(c)).data();
    const double* point = layers.data();
    for (Vec3& coefficient : curves[c]) {
      Lanes sum = {0, 0, 0, 0};
      for (Eigen::Index p = 0; p < points; ++p, point += kPositionDimension) {
        sum += weights[p] * (load_unaligned(point) - padded_origin);
      }
      coefficient = to_vec3(sum);
    }
    curves[c] = to_bernstein(curves[c]);
  }
  const Curve& position = curves.front();
  Curve steps;
  for (std::size_t i = 0; i < 3; ++i) steps[i] = 3 * (position[i + 1] - position[i]);
  steps[3] = steps[2];
  FoldFinding worst;
  for (std::size_t c = 1; c < curves.size() && worst.verdict != FoldVerdict::kFolds; c += 2) {
    const Curve &along_u = curves[c], &along_v = curves[c + 1];
    const double rounding = kProductRounding * longest(along_u) * longest(along_v) * longest(steps);
    const Least least = least_of(determinant(along_u, along_v, position), rounding);
    const FoldVerdict verdict = std::max(worst.verdict, least.verdict);
    if (least.value < worst.determinant) worst = {verdict, least.value, origin + value_at(position, least.w)};
    worst.verdict = verdict;
  }
  return worst;
}

}  // namespace ccslice
