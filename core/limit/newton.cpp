// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/newton.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ccslice {

namespace {

constexpr int kMaxSteps = 40;
constexpr double kSoftClip = 0.1;   // Irregular cells: the share of the way to 0 or 1 that must remain.
constexpr double kDamping = 1e-12;  // Relative; only for Jacobians that are singular to rounding.
constexpr double kSnap = 1e-9;      // Coordinates this near to 0 or 1 are tried at 0 or 1.

struct Interval {
  double low, high;
};

/// Solves J d = r for the free coordinates in the least-squares sense; the others keep their d.
///
/// With J_f the columns of the free coordinates and r' = r - sum of the held d_a J_a: d_f = (J_f^T J_f)^-1 J_f^T r'. If
/// all are free this is J^-1 r, which costs half as much and loses no digits to squaring. A Jacobian that is singular
/// to rounding, as on the lines where irregular cells degenerate, gets a little damping: the step stays finite, and
/// follows the directions that J can tell apart.
void solve_free(const Mat3& jacobian, const Vec3& r, const std::array<bool, 3>& held, Vec3& d) noexcept {
  Vec3 rest = r;
  Mat3 reduced = jacobian;
  for (int a = 0; a < 3; ++a) {
    if (!held[static_cast<std::size_t>(a)]) continue;
    rest -= d[a] * jacobian.col(a);
    reduced.col(a).setZero();
  }
  const bool all_free = !held[0] && !held[1] && !held[2];
  const double scale = jacobian.colwise().norm().prod();
  if (all_free && std::abs(jacobian.determinant()) > kDamping * scale) {
    d = jacobian.inverse() * rest;
    return;
  }
  Mat3 normal = reduced.transpose() * reduced;
  const double damping = kDamping * normal.trace() + std::numeric_limits<double>::min();
  for (int a = 0; a < 3; ++a) normal(a, a) += held[static_cast<std::size_t>(a)] ? 1 : damping;
  const Vec3 solved = normal.inverse() * (reduced.transpose() * rest);
  for (int a = 0; a < 3; ++a) {
    if (!held[static_cast<std::size_t>(a)]) d[a] = solved[a];
  }
}

struct Step {
  Vec3 uvw;
  bool held;  // Some coordinate was held back.
};

/// One step from `uvw`: Newton, with coordinates held at the ends of their intervals where they would pass them.
///
/// Holding one coordinate changes what the others should do, so they are solved again: at most once for each
/// coordinate. Merely clipping the full step would not slide along the face but leave it at the wrong place, where the
/// next step is clipped again.
Step bounded_step(const Mat3& jacobian, const Vec3& residual, const Vec3& uvw,
                  const std::array<Interval, 3>& bounds) noexcept {
  std::array<bool, 3> held{};
  Vec3 d = Vec3::Zero();
  for (int round = 0; round < 3; ++round) {
    solve_free(jacobian, residual, held, d);
    bool passed = false;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      if (held[i]) continue;
      const double target = uvw[a] + d[a];
      if (target >= bounds[i].low && target <= bounds[i].high) continue;
      d[a] = std::clamp(target, bounds[i].low, bounds[i].high) - uvw[a];
      held[i] = passed = true;
    }
    if (!passed) break;
  }
  Vec3 next = uvw + d;
  for (int a = 0; a < 3; ++a) {
    const auto& [low, high] = bounds[static_cast<std::size_t>(a)];
    next[a] = std::isfinite(next[a]) ? std::clamp(next[a], low, high) : uvw[a];
  }
  return {next, held[0] || held[1] || held[2]};
}

/// Where a step from `uvw` may lead. In irregular cells a tenth of the way to a face always remains (soft clip): on the
/// face itself the Jacobian may be singular or unbounded, and no next step could be told from there. Towards a face the
/// iteration so converges like 0.1^n, which snap() completes.
std::array<Interval, 3> bounds_at(const Vec3& uvw, bool regular) noexcept {
  std::array<Interval, 3> bounds;
  for (int a = 0; a < 3; ++a) {
    bounds[static_cast<std::size_t>(a)] =
        regular ? Interval{0, 1} : Interval{kSoftClip * uvw[a], 1 - kSoftClip * (1 - uvw[a])};
  }
  return bounds;
}

/// The soft clip never arrives at a face: if the best parameter nearly lies on one, the face itself may be better.
void snap(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& point, NewtonResult& best) noexcept {
  Vec3 snapped = best.uvw;
  for (int a = 0; a < 3; ++a) {
    if (snapped[a] < kSnap) snapped[a] = 0;
    if (snapped[a] > 1 - kSnap) snapped[a] = 1;
  }
  if (snapped == best.uvw) return;
  const double residual = (evaluator.geo({cell, snapped}) - point).norm();
  if (residual < best.residual_mm) best = {snapped, residual, best.steps};
}

}  // namespace

NewtonResult newton_in_cell(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& start, const Vec3& point,
                            const Acceptance& acceptance, Patience patience) noexcept {
  const bool regular = evaluator.solid().cell_class(cell) == CellClass::kRegular;
  const double accept_mm = acceptance.in_cell(cell);
  NewtonResult best{start, std::numeric_limits<double>::infinity()};
  Vec3 uvw = start;
  int idle = 0;  // Counts held steps only: free ones may stagnate for longer beside singular corners, and arrive.
  bool held = false;
  for (int step = 0; step <= kMaxSteps; ++step) {
    const LimitSample sample = evaluator.sample({cell, uvw});
    const Vec3 residual = point - sample.position;
    const double norm = residual.norm();
    idle = !held || norm < 0.9 * best.residual_mm ? 0 : idle + 1;
    const bool better = norm < best.residual_mm;
    if (better) best = {uvw, norm, step};
    best.accepted = best.residual_mm <= accept_mm;
    if (best.residual_mm <= acceptance.least_mm() || (best.accepted && !better)) break;
    if (idle >= static_cast<int>(patience)) break;
    const Step next = bounded_step(sample.jacobian, residual, uvw, bounds_at(uvw, regular));
    const double length = (next.uvw - uvw).cwiseAbs().maxCoeff();
    if (length == 0 || (best.accepted && length <= kAcceptOfCell)) break;
    uvw = next.uvw;
    held = next.held;
  }
  if (!regular && !best.accepted) {
    snap(evaluator, cell, point, best);
    best.accepted = best.residual_mm <= accept_mm;
  }
  return best;
}

}  // namespace ccslice
