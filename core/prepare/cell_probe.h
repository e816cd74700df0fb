// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether a cell holds a point, and how far below the boundary of the solid the point is then.
//
// Private to core/limit.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/limit/acceptance.h"
#include "core/limit/limit_evaluator.h"

namespace ccslice {

/// Overlaps of less than this aren't looked for: parts that fit each other exactly are off by rounding.
inline constexpr double kLeastOverlapMm = 1e-3;

struct PlaceInCell {
  Vec3 uvw;
  double depth_mm;        // To the nearest of the cell's sides on the boundary, to first order; infinite without any.
  Mat3 inverse_jacobian;  // There.
};

/// One solid, one thread.
class CellProbe {
 public:
  /// REQUIRES: the solid outlives this.
  explicit CellProbe(const LimitSolid& solid)
      : solid_(solid), evaluator_(solid, kPatchCacheBytes), acceptance_(solid, kAcceptMm) {}

  LimitEvaluator& evaluator() noexcept { return evaluator_; }
  /// The work so far, in boxes compared (some fifty nanoseconds): a point looked for by Newton's method takes as long
  /// as 32 of them.
  std::uint64_t work() const noexcept { return work_; }
  /// Nothing if the cell doesn't hold the point, or not deeper than kLeastOverlapMm.
  std::optional<PlaceInCell> find(LimitCellId cell, const Vec3& point) noexcept;

 private:
  static constexpr double kAcceptMm = 1e-6;
  static constexpr std::size_t kPatchCacheBytes = 1 << 16;  // A few cells: preparing has no room for more.

  const LimitSolid& solid_;
  LimitEvaluator evaluator_;
  Acceptance acceptance_;
  std::uint64_t work_ = 0;
};

}  // namespace ccslice
