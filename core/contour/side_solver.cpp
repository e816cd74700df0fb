// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/side_solver.h"

#include <cmath>

namespace ccslice {
namespace {

constexpr double kUnit = 1.0 / kSurfaceOne;
constexpr int kMaxHalvings = 100;
constexpr double kSmallestInterval = 1e-15;
constexpr int kLastLevel = 52;  // Pieces towards an irregular vertex; what remains is shorter than rounding.

double slope(const std::array<double, 4>& cubic, double u) {
  const double v = 1 - u;
  return 3 * (v * v * (cubic[1] - cubic[0]) + 2 * u * v * (cubic[2] - cubic[1]) + u * u * (cubic[3] - cubic[2]));
}

/// The parameter in [low, high] where the cubic changes sides: Newton's method, kept between the ends by bisection. If
/// rounding has left no change of sides (the ends' sides are decided elsewhere), the end nearer the plane.
///
/// Each iterate replaces the end on its own side, so a change of sides always lies between the two. Near a simple root
/// Newton's method converges quadratically. A step that leaves the interval, or is no number as the slope is 0, becomes
/// a bisection. Where the coefficients are monotone this root is the only one. Elsewhere any does: the two leaves at a
/// side share what was found for one of them (contour.h).
double root(const std::array<double, 4>& z, double low, double high) {
  const double f_low = evaluate(z, low), f_high = evaluate(z, high);
  if (side_of(f_low) == side_of(f_high)) return std::abs(f_low) < std::abs(f_high) ? low : high;
  const bool rising = side_of(f_high) == PlaneSide::kAbove;
  double u = low - f_low * (high - low) / (f_high - f_low);
  for (int step = 0; step < kMaxHalvings && high - low > kSmallestInterval; ++step) {
    const double f = evaluate(z, u);
    ((side_of(f) == PlaneSide::kAbove) == rising ? high : low) = u;
    double next = u - f / slope(z, u);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - u) <= kSmallestInterval) return next;
    u = next;
  }
  return u;
}

}  // namespace

void SideSolver::start(const AffineMap& to_axes, double height_mm) {
  to_axes_ = to_axes;
  height_mm_ = height_mm;
  irregular_face_ = kNoFace;
}

double SideSolver::height(const LeafSurface& leaf, int side, std::uint32_t s, std::uint32_t t) {
  const double position = (side % 2 == 0 ? s : t) * kUnit;
  const Piece piece = piece_of(leaf, side, position);
  return evaluate(piece.curve.z, (position - piece.begin) / (piece.end - piece.begin));
}

SidePoint SideSolver::crossing(const LeafSurface& leaf, int side, const SideEnd& from, const SideEnd& to) {
  const bool along_s = side % 2 == 0;
  const bool ascending = along_s ? from.s < to.s : from.t < to.t;
  const SideEnd& first = ascending ? from : to;
  const double low = (along_s ? first.s : first.t) * kUnit;
  const SideEnd& last = ascending ? to : from;
  double high = (along_s ? last.s : last.t) * kUnit;
  // Down the pieces towards an irregular vertex until one has the change of sides: while a piece's end near the vertex
  // is on the same side as the far end, the plane is crossed nearer to the vertex. If no piece down to kLastLevel has
  // it, rounding hides it, and the last one's near end is taken for it.
  Piece piece = piece_of(leaf, side, high);
  while (piece.begin > low && side_of(piece.curve.z[0]) == last.side) {
    high = piece.begin;
    if (high <= std::ldexp(1.0, -kLastLevel - 1)) break;
    piece = piece_of(leaf, side, high);
  }
  const double length = piece.end - piece.begin;
  const double u_low = std::max(0.0, (low - piece.begin) / length);
  const double u = root(piece.curve.z, u_low, std::min(1.0, (high - piece.begin) / length));
  const double at = piece.begin + u * length;
  const Vec2 xy(evaluate(piece.curve.x, u), evaluate(piece.curve.y, u));
  return {along_s ? at : first.s * kUnit, along_s ? first.t * kUnit : at, xy};
}

SideSolver::Piece SideSolver::piece_of(const LeafSurface& leaf, int side, double position) {
  Piece piece;
  // Of a remainder only sides 0 and 3 run into the vertex; it shares sides 1 and 2 with regular boxes, as cubics.
  if (!leaf.node.remainder || side == 1 || side == 2) {
    const double begin = (side % 2 == 0 ? leaf.node.box.s : leaf.node.box.t) * kUnit;
    piece = {side_curve(leaf.net, side), begin, begin + leaf.node.box.size * kUnit};
  } else {
    int level = 0;
    while (level < kLastLevel && std::ldexp(1.0, -level - 1) >= position) ++level;
    piece = {irregular_piece(leaf.node.box.face, side == 0 ? 0 : 1, level), std::ldexp(1.0, -level - 1),
             std::ldexp(1.0, -level)};
  }
  for (double& z : piece.curve.z) z -= height_mm_;
  return piece;
}

const BezierCurve& SideSolver::irregular_piece(BoundaryFaceId face, int axis, int level) {
  if (face != irregular_face_) {
    irregular_face_ = face;
    irregular_.clear();
    surface_.irregular_corner(face, corner_);
  }
  while (static_cast<int>(irregular_.size()) <= level) {
    std::array<BezierPatch, 3> patches;
    surface_.split(corner_, patches);
    irregular_.push_back(
        {side_curve(transformed(patches[0], to_axes_), 0), side_curve(transformed(patches[1], to_axes_), 3)});
  }
  return irregular_[level][axis];
}

}  // namespace ccslice
