// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/nearest_place.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ccslice {

namespace {

constexpr int kMostSteps = 60;
constexpr double kFirstDamping = 1e-3, kLeastDamping = 1e-12, kMostDamping = 1e6;
constexpr double kFirstGrowth = 2, kLeastGrowth = 0.1;  // Of the damping, after a step that failed, or that did well.
constexpr double kInside = 0.125;                       // The second start is that far inside of the cell.

/// The quadratic model about a place: cost(d) = d^T A d - 2 g^T d, but for a constant.
struct Model {
  Mat3 a;
  Vec3 g;
  Vec3 low, high;  // Of d.

  double cost(const Vec3& d) const { return d.dot(a * d) - 2 * g.dot(d); }
};

Model model_at(const Mat3& jacobian, const Vec3& residual, const Vec3& uvw, double damping) {
  Mat3 a = jacobian.transpose() * jacobian;
  const double least = std::numeric_limits<double>::epsilon() * a.trace() + std::numeric_limits<double>::min();
  a.diagonal() += damping * a.diagonal() + Vec3::Constant(least);
  return {a, jacobian.transpose() * residual, -uvw, Vec3::Ones() - uvw};
}

/// The step with some coordinates held at the ends of their intervals: `ends` has -1 or 1 for these, else 0.
Vec3 step_with(const Model& model, const std::array<int, 3>& ends) {
  Mat3 a = model.a;
  Vec3 g = model.g;
  for (int i = 0; i < 3; ++i) {
    const int end = ends[static_cast<std::size_t>(i)];
    if (end == 0) continue;
    const double held = end < 0 ? model.low[i] : model.high[i];
    g -= held * model.a.col(i);
    a.row(i).setZero();
    a.col(i).setZero();
    a(i, i) = 1;
  }
  for (int i = 0; i < 3; ++i) {
    const int end = ends[static_cast<std::size_t>(i)];
    if (end != 0) g[i] = end < 0 ? model.low[i] : model.high[i];
  }
  return a.inverse() * g;
}

/// The least of all choices that stay within the intervals.
Vec3 best_step(const Model& model) {
  const Vec3 free = step_with(model, {0, 0, 0});
  const auto is_within = [&](const Vec3& d) {
    return (d.array() >= model.low.array()).all() && (d.array() <= model.high.array()).all();
  };
  if (is_within(free)) return free;
  Vec3 best = Vec3::Zero();
  double least = 0;  // Staying costs nothing.
  for (int choice = 1; choice < 27; ++choice) {
    const std::array<int, 3> ends = {(choice + 1) % 3 - 1, (choice / 3 + 1) % 3 - 1, (choice / 9 + 1) % 3 - 1};
    const Vec3 d = step_with(model, ends);
    if (!is_within(d)) continue;
    const double cost = model.cost(d);
    if (cost >= least) continue;
    least = cost;
    best = d;
  }
  return best;
}

NewtonResult descend(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& start, const Vec3& point,
                     const Acceptance& acceptance) noexcept {
  LimitSample sample = evaluator.sample({cell, start});
  NewtonResult best{start, (point - sample.position).norm()};
  double damping = kFirstDamping, growth = kFirstGrowth;
  while (best.steps < kMostSteps && damping <= kMostDamping && best.residual_mm > acceptance.least_mm()) {
    if (!sample.jacobian.allFinite()) break;
    const Model model = model_at(sample.jacobian, point - sample.position, best.uvw, damping);
    const Vec3 step = best_step(model);
    const double length = step.cwiseAbs().maxCoeff();
    if (!(length > 0)) break;
    ++best.steps;
    const Vec3 next = (best.uvw + step).cwiseMax(0).cwiseMin(1);
    const LimitSample there = evaluator.sample({cell, next});
    const double residual_mm = (point - there.position).norm();
    if (residual_mm < best.residual_mm) {
      const double gain = (best.residual_mm - residual_mm) * (best.residual_mm + residual_mm) / -model.cost(step);
      damping = std::max(damping * std::clamp(1 - std::pow(2 * gain - 1, 3), kLeastGrowth, 2.0), kLeastDamping);
      growth = kFirstGrowth;
      best.uvw = next;
      best.residual_mm = residual_mm;
      sample = there;
    } else {
      damping *= growth;
      growth *= 2;
    }
    if (length <= kAcceptOfCell) break;
  }
  return best;
}

}  // namespace

NewtonResult nearest_in_cell(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& start, const Vec3& point,
                             const Acceptance& acceptance) noexcept {
  NewtonResult best = descend(evaluator, cell, start, point, acceptance);
  const Vec3 inside = start.cwiseMax(kInside).cwiseMin(1 - kInside);
  if (inside != start && best.residual_mm > acceptance.least_mm()) {
    const NewtonResult other = descend(evaluator, cell, inside, point, acceptance);
    const int steps = best.steps + other.steps;
    if (other.residual_mm < best.residual_mm) best = other;
    best.steps = steps;
  }
  best.accepted = best.residual_mm <= acceptance.in_cell(cell);
  return best;
}

}  // namespace ccslice
