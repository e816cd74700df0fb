// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points spread over a solid with the volumes that they stand for: in a regular grid of the parameters of each cell, or
// of evenly spread cells where there are many. For shares of the volume that are told to people.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/types.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// The solid outlives it.
class SolidSampler {
 public:
  explicit SolidSampler(const LimitSolid& solid)
      : solid_(solid),
        step_(1 + (solid.cell_count() - 1) / kMostPoints),
        per_edge_(std::clamp(static_cast<int>(std::cbrt(kMostPoints / solid.cell_count())), 1, kMostPerEdge)) {}

  /// visit(evaluator, point, volume), mm^3 in the mesh's frame, of some thousands of points.
  template <typename Visit>
  void run(Visit&& visit) const {
    LimitEvaluator evaluator(solid_);
    const double points = per_edge_ * per_edge_ * per_edge_;
    const auto at = [&](int i) { return (i + 0.5) / per_edge_; };
    for (LimitCellId cell; cell < solid_.cell_count(); cell += step_) {
      for (int k = 0; k < per_edge_ * per_edge_ * per_edge_; ++k) {
        const CellParam param{cell,
                              Vec3(at(k % per_edge_), at(k / per_edge_ % per_edge_), at(k / per_edge_ / per_edge_))};
        visit(evaluator, param, std::abs(evaluator.sample(param).jacobian.determinant()) / points);
      }
    }
  }

 private:
  static constexpr std::uint32_t kMostPoints = 4096;
  static constexpr int kMostPerEdge = 8;

  const LimitSolid& solid_;
  std::uint32_t step_;
  int per_edge_;
};

}  // namespace ccslice
