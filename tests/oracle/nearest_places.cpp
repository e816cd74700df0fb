// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/nearest_places.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cstddef>

#include "core/limit/cell_index.h"

namespace ccslice::oracle {
namespace {

constexpr int kStartsAnAxis = 5, kMostSteps = 100, kMostHalvings = 30;
constexpr std::size_t kStarts = 6;

NearPlace place_at(LimitEvaluator& evaluator, const CellParam& at, const Vec3& point) {
  const Vec3 position = evaluator.geo(at);
  return {at, position, (position - point).norm()};
}

/// Coordinates at 0 or 1 stay there while the point pulls them outwards.
Vec3 move_at(const LimitSample& sample, const Vec3& uvw, const Vec3& residual) {
  const Vec3 pull = sample.jacobian.transpose() * residual;
  Mat3 free = sample.jacobian;
  for (int a = 0; a < 3; ++a) {
    if ((uvw[a] <= 0 && pull[a] <= 0) || (uvw[a] >= 1 && pull[a] >= 0)) free.col(a).setZero();
  }
  return Eigen::JacobiSVD<Mat3>(free, Eigen::ComputeFullU | Eigen::ComputeFullV).solve(residual);
}

NearPlace descend(LimitEvaluator& evaluator, NearPlace place, const Vec3& point) {
  for (int step = 0; step < kMostSteps; ++step) {
    const LimitSample sample = evaluator.sample(place.at);
    if (!sample.jacobian.allFinite()) break;
    Vec3 move = move_at(sample, place.at.uvw, point - sample.position);
    bool nearer = false;
    for (int halving = 0; halving < kMostHalvings && !nearer; ++halving, move /= 2) {
      const CellParam next{place.at.cell, (place.at.uvw + move).cwiseMax(0).cwiseMin(1)};
      const NearPlace there = place_at(evaluator, next, point);
      nearer = there.distance_mm < place.distance_mm;
      if (nearer) place = there;
    }
    if (!nearer) break;
  }
  return place;
}

NearPlace nearest_of(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& point) {
  std::vector<NearPlace> starts;
  for (int i = 0; i < kStartsAnAxis * kStartsAnAxis * kStartsAnAxis; ++i) {
    const Vec3 step(i % kStartsAnAxis, i / kStartsAnAxis % kStartsAnAxis, i / (kStartsAnAxis * kStartsAnAxis));
    starts.push_back(place_at(evaluator, {cell, step / (kStartsAnAxis - 1)}, point));
  }
  std::ranges::sort(starts, {}, &NearPlace::distance_mm);
  NearPlace nearest = starts.front();
  for (std::size_t i = 0; i < kStarts; ++i) {
    const NearPlace found = descend(evaluator, starts[i], point);
    if (found.distance_mm < nearest.distance_mm) nearest = found;
  }
  return nearest;
}

}  // namespace

std::vector<NearPlace> nearest_places(LimitEvaluator& evaluator, const Vec3& point, double within_mm) {
  std::vector<LimitCellId> cells;
  evaluator.solid().index().cell_boxes.visit_at(point, within_mm,
                                                [&](std::uint32_t item) { cells.push_back(LimitCellId{item}); });
  std::vector<NearPlace> places;
  for (const LimitCellId cell : cells) places.push_back(nearest_of(evaluator, cell, point));
  std::ranges::stable_sort(places, {}, &NearPlace::distance_mm);
  return places;
}

}  // namespace ccslice::oracle
