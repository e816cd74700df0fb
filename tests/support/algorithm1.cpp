// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/algorithm1.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace ccslice::oracle {

Algorithm1::Algorithm1(Algorithm1Solid& solid, const Algorithm1Options& options) : solid_(solid), options_(options) {}

void Algorithm1::add_candidate(LimitCellId cell, const Vec3& point) {
  Candidate best{cell, Vec3::Zero(), std::numeric_limits<double>::infinity()};
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) {
        const Vec3 q(i / 3.0, j / 3.0, k / 3.0);
        const double distance2 = (solid_.geo({cell, q}) - point).squaredNorm();
        if (distance2 < best.distance2) best = {cell, q, distance2};
      }
    }
  }
  candidates_.push_back(best);
}

std::optional<CellParam> Algorithm1::trace(const Vec3& point) {
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
    return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : a.cell < b.cell;
  });
  for (const Candidate& candidate : candidates_) {
    if (const auto found = newton({candidate.cell, candidate.start}, point)) return found;
  }
  return std::nullopt;
}

std::optional<CellParam> Algorithm1::newton(const CellParam& start, const Vec3& point) {
  CellParam at = start;
  Vec3 position;
  Mat3 jacobian;
  for (int k = 0; k <= options_.max_iterations; ++k) {
    solid_.geo_and_jacobian(at, position, jacobian);
    const Vec3 error = point - position;
    if (error.norm() <= options_.threshold_mm) return at;
    const Vec3 step = jacobian.partialPivLu().solve(error);
    if (!step.allFinite()) return std::nullopt;
    const Vec3 next = (at.uvw + step).cwiseMax(0.0).cwiseMin(1.0);
    const Vec3 clipped_step = next - at.uvw;
    const bool stationary =
        clipped_step.norm() < options_.smallest_step && (jacobian * clipped_step).norm() < options_.smallest_step;
    if (stationary) return std::nullopt;
    at.uvw = next;
  }
  return std::nullopt;
}

std::optional<CellParam> Algorithm1::invert(const Vec3& point) {
  ++full_inversions_;
  ring_cells_.clear();
  const std::span<const Box3> ring_boxes = solid_.ring_boxes();
  for (const LimitCellId cell : IdRange<LimitCellId>(ring_boxes.size())) {
    if (ring_boxes[cell].contains(point)) ring_cells_.push_back(cell);
  }
  candidates_.clear();
  for (const LimitCellId cell : ring_cells_) {
    if (solid_.corner_boxes()[cell].contains(point)) add_candidate(cell, point);
  }
  if (const auto found = trace(point)) return found;
  candidates_.clear();
  for (const LimitCellId cell : ring_cells_) add_candidate(cell, point);
  return trace(point);
}

void Algorithm1::invert_line(std::span<const Vec3> points, const std::vector<bool>& inside,
                             std::span<const std::optional<CellParam>> previous,
                             std::span<std::optional<CellParam>> line) {
  for (std::size_t x = 0; x < points.size(); ++x) {
    line[x].reset();
    if (!inside[x]) continue;
    const auto try_from = [&](const std::optional<CellParam>& neighbour) {
      if (!line[x] && neighbour) line[x] = newton(*neighbour, points[x]);
    };
    if (x > 0) try_from(line[x - 1]);
    if (!previous.empty()) {
      try_from(previous[x]);
      if (x > 0) try_from(previous[x - 1]);
      if (x + 1 < previous.size()) try_from(previous[x + 1]);
    }
    if (line[x]) {
      ++coherent_inversions_;
    } else {
      line[x] = invert(points[x]);
    }
  }
}

}  // namespace ccslice::oracle
