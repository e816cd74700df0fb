// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What each control point of an irregular cell's ring weighs in the limit at chosen parameters: LIMIT STENCILS.
//
// Evaluating a place means to walk down to its patch, ring by ring, and a block's nodes lie in dozens of patches. The
// weights depend on the neighbourhood alone (its operator), not on where the points are; so all cells of a
// neighbourhood share those of a box of parameters, and a block is one product of a matrix with the ring's points. They
// are found by the same walk the other way round, from patches' basis functions up to the ring, for all places
// together: with A_k the rows that lead from level k - 1 to level k, b a patch's basis functions at a place and P the
// ring's points, the limit is
//
//   b^T (A_n ... (A_2 (A_1 P)))  =  (((b^T A_n) ... A_2) A_1) P,
//
// where the left side needs the points and the right side's brackets, the weights, don't. On the irregular line or
// vertex itself the limit row takes the place of b^T A_n ... A_1.
//
// Private to the core.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/limit/solid_data.h"

namespace ccslice {

/// Places are taken in strips of two registers.
inline constexpr std::size_t kStencilStrip = 2 * kLanes;

/// Immutable: may be shared.
class LimitStencils {
 public:
  /// The stencils at parameters in the cell's frame (Frame::to_framed). REQUIRES: `cell` isn't regular.
  LimitStencils(const LimitSolid::Data& data, const LimitCell& cell, std::span<const Vec3> framed);

  /// Calls put(strip, first, last) for each strip of places. The ring's points have four numbers each: first[d] holds
  /// the limits of the d-th one at the strip's first four places, last[d] at its last four. REQUIRES: zeros for points
  /// that the ring lacks.
  template <typename Put>
  void apply(const Lanes* points, Put put) const noexcept {
    for (std::size_t strip = 0; strip < strips_; ++strip) {
      std::array<Lanes, 4> first{}, last{};
      const Lanes* weights = &weights_[strip * points_ * 2];
      for (std::size_t p = 0; p < points_; ++p, weights += 2) {
        for (std::size_t d = 0; d < 4; ++d) {
          first[d] = multiply_add(weights[0], points[p][d], first[d]);
          last[d] = multiply_add(weights[1], points[p][d], last[d]);
        }
      }
      put(strip, first, last);
    }
  }

  std::size_t points() const noexcept { return points_; }
  std::size_t memory_bytes() const noexcept { return sizeof(*this) + weights_.capacity() * sizeof(Lanes); }

 private:
  std::size_t points_ = 0, strips_ = 0;
  std::vector<Lanes> weights_;  // By strip, then by point.
};

}  // namespace ccslice
