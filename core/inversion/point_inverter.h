// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Point inversion [Luu19, 3.2.2, Alg. 1]: the parameter (i,u,v,w) that geo maps to a given point.
//
// Candidate cells come from an index over the bounding boxes of the limit cells, never from all cells. Each has a first
// guess of the parameter from its middle and the Jacobian there; Newton (newton.h) starts from those, the nearest to a
// cell's middle first, and gives wrong cells up quickly. Where that fails, it starts in each at the nearest of the
// interior points (i + 1/2)/2, and at last at the nearest few of (i + 1/2)/4. A result is accepted after clamping
// (acceptance.h). Of a point that no cell holds the nearest place is looked for (nearest_place.h), from where Newton's
// method got stuck, in the best cell and in the first candidates besides. The work for one point is bounded, and so
// is the memory: of the candidates only as many are kept as Newton may run.
//
// Of points all over a solid's box many lie in the boxes of cells and in none of them, and nothing is searched for
// longer than what isn't there. So before the search gets thorough, cells that are proved not to hold the point may be
// left out (limit/cell_distance.h), which changes no answer. And points that are known together are solved cell by
// cell, since the patches of irregular cells take longer to make than to use.

#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "core/base/cancellation.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct InversionOptions {
  double accept_mm = 1e-6;   // A point inside: |geo - point| at most this, and less in small cells (acceptance.h).
  double outside_mm = 2e-3;  // Points this far outside the limit volume still get the nearest parameter found.
                             // REQUIRES: no less than accept_mm.
  std::size_t patch_cache_bytes = kSmallPatchCacheBytes;
  bool proves_outside = false;  // Cells are left out by proof. The answers are the same, unless the work for a point
                                // runs out; where most points are inside, it takes longer.
};

struct InversionResult {
  CellParam at;
  double residual_mm = 0;  // |geo(at) - point|.
  int newton_steps = 0;
  bool full = false;  // Cells were searched for (no hint, or not found in the hint's cell).
};

/// One solid, one thread. Distances are measured in the mesh frame.
class PointInverter {
 public:
  explicit PointInverter(const LimitSolid& solid, const InversionOptions& options = {});
  ~PointInverter();
  PointInverter(PointInverter&&) noexcept;
  PointInverter& operator=(PointInverter&&) noexcept;

  /// `point`: mesh frame, mm. `hint`: a parameter solved for a point nearby (coherence), or nothing.
  /// Returns nothing if no candidate cell comes within options.outside_mm. Near cells that fold, or overlap others of
  /// their part, the lowest cell id wins, and where separate parts of the solid overlap the part whose first cell is
  /// the lowest: whatever the hint.
  [[nodiscard]] std::optional<InversionResult> invert(const Vec3& point,
                                                      const std::optional<CellParam>& hint = {}) noexcept;

  using OnFound = std::function<void(std::size_t point, const InversionResult& result)>;
  /// Calls on_found() for each point that invert() finds without a hint, with the same result to the last bit. The
  /// order is that of cells. Throws Error{kCancelled} and what on_found() throws. REQUIRES: fewer than 2^32 points.
  void invert(std::span<const Vec3> points, const OnFound& on_found, const CancellationToken& cancel);

  LimitEvaluator& evaluator() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
