// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/arc_tracer.h"

#include <algorithm>
#include <cmath>

#include "core/base/lanes.h"

namespace ccslice {
namespace {

constexpr int kMaxPasses = 32;
constexpr double kMaxParts = 1024;  // A chord is cut into at most so many parts in one pass.
constexpr double kShortest = 1e-9;  // Chords aren't parted below, in the leaf's parameters.
constexpr int kMaxSteps = 64;
constexpr double kSmallestStep = 1e-9;  // Newton's method squares it once more.

// Lanes hold four places along the arc.
using LaneMask = long long __attribute__((vector_size(32)));

Lanes all(double value) { return Lanes{value, value, value, value}; }

bool any(const LaneMask& mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

/// a + u (b + u (c + u d)).
struct Cubic {
  Lanes a, b, c, d;

  Lanes at(const Lanes& u) const { return a + u * (b + u * (c + u * d)); }
  Lanes slope(const Lanes& u) const { return b + u * (2 * c + u * (3 * d)); }
};

/// Derivatives of the Bernstein basis.
std::array<Lanes, 4> bernstein(const Lanes& u) {
  const Lanes v = 1 - u;
  return {v * v * v, 3 * u * v * v, 3 * u * u * v, u * u * u};
}

/// A coordinate of the net along t at four values of s, or along s at four values of t.
Cubic cross_section(const NetCoefficients& net, bool fixed_s, const std::array<Lanes, 4>& basis) {
  const int step = fixed_s ? 1 : 4, stride = fixed_s ? 4 : 1;
  std::array<Lanes, 4> b;
  for (int k = 0; k < 4; ++k) {
    const double* row = &net[stride * k];
    b[k] = basis[0] * row[0] + basis[1] * row[step] + basis[2] * row[2 * step] + basis[3] * row[3 * step];
  }
  return {b[0], 3 * (b[1] - b[0]), 3 * (b[2] - 2 * b[1] + b[0]), b[3] - b[0] + 3 * (b[1] - b[2])};
}

/// The roots in [0,1] of cubics that are strictly monotone there; where there is no change of sign, the end nearer to
/// zero.
///
/// Newton's method alone may leave [0,1] where the slope nearly vanishes. So the root is kept between bounds, which
/// each value narrows as its sign says on which side of the root u lies, and a step that leaves them is replaced by
/// bisection. The last step is below 1e-9, and Newton's method squares the error once more: roots are exact to
/// rounding, whatever the start, so a point of the arc doesn't depend on the points before it.
Lanes roots(const Cubic& cubic, Lanes u) {
  const LaneMask rises = cubic.b + cubic.c + cubic.d > 0;
  Lanes low = all(0), high = all(1);
  for (int step = 0; step < kMaxSteps; ++step) {
    const Lanes value = cubic.at(u);
    const LaneMask beyond = (value > 0) == rises;
    high = beyond ? u : high;
    low = beyond ? low : u;
    Lanes next = u - value / cubic.slope(u);
    next = (next >= low) & (next <= high) ? next : 0.5 * (low + high);
    const Lanes moved = next - u;
    u = next;
    if (!any((moved > kSmallestStep) | (moved < -kSmallestStep))) break;
  }
  return u;
}

}  // namespace

std::span<const ArcPoint> ArcTracer::trace(const LeafSurface& leaf, double height_mm, const ArcPoint& from,
                                           const ArcPoint& to, double tolerance_mm) {
  const LevelLines lines = leaf.node.level_lines;
  along_s_ = lines == LevelLines::kAcrossT ||
             (lines == LevelLines::kAcrossST && std::abs(to.s - from.s) >= std::abs(to.t - from.t));
  points_.assign({from, to});
  for (int pass = 0; pass < kMaxPasses && part_chords(leaf.node.chord, tolerance_mm); ++pass) {
    solve(leaf.net, height_mm);
  }
  return points_;
}

/// Parts chords that may be farther from the surface than the tolerance, evenly in the parameter. Returns false if none
/// was. A chord's error falls with the square of its length, so ceil(sqrt(error / tolerance)) parts are enough where
/// the arc is straight in the parameters; where it bends, the next pass parts what is still too long.
bool ArcTracer::part_chords(const ChordBound& bound, double tolerance_mm) {
  parted_.clear();
  unsolved_.clear();
  for (std::size_t k = 0; k + 1 < points_.size(); ++k) {
    const ArcPoint &p = points_[k], &q = points_[k + 1];
    parted_.push_back(p);
    const double ds = q.s - p.s, dt = q.t - p.t;
    const double error_mm = bound.along(ds, dt);
    if (error_mm <= tolerance_mm || std::abs(along_s_ ? ds : dt) < kShortest) continue;
    const double parts = std::min(std::ceil(std::sqrt(error_mm / tolerance_mm)), kMaxParts);
    for (double part = 1; part < parts; ++part) {
      unsolved_.push_back(parted_.size());
      parted_.push_back({p.s + part / parts * ds, p.t + part / parts * dt, Vec2::Zero()});
    }
  }
  parted_.push_back(points_.back());
  points_.swap(parted_);
  return !unsolved_.empty();
}

void ArcTracer::solve(const BezierNet& net, double height_mm) {
  for (std::size_t first = 0; first < unsolved_.size(); first += 4) {
    const std::size_t count = std::min<std::size_t>(4, unsolved_.size() - first);
    Lanes fixed, guess;
    for (std::size_t k = 0; k < 4; ++k) {
      const ArcPoint& point = points_[unsolved_[first + std::min(k, count - 1)]];
      fixed[k] = along_s_ ? point.s : point.t;
      guess[k] = along_s_ ? point.t : point.s;
    }
    const std::array<Lanes, 4> basis = bernstein(fixed);
    Cubic z = cross_section(net.z, along_s_, basis);
    z.a -= height_mm;
    const Lanes solved = roots(z, guess);
    const Lanes x = cross_section(net.x, along_s_, basis).at(solved);
    const Lanes y = cross_section(net.y, along_s_, basis).at(solved);
    for (std::size_t k = 0; k < count; ++k) {
      ArcPoint& point = points_[unsolved_[first + k]];
      (along_s_ ? point.t : point.s) = solved[k];
      point.xy = {x[k], y[k]};
    }
  }
}

}  // namespace ccslice
