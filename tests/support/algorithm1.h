// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Algorithm 1 of [Luu19, 3.2.2], word for word, with its optimization by coherence: the reference for results and, with
// plain good C++, the baseline of the benches.
//
// Full inversion of a point: list L of the cells whose one-ring's control points have the point in their box, sublist l
// of those whose own corners do; a starting value per cell, the nearest of a uniform 4 x 4 x 4 grid on [0,1]^3 (0 and 1
// included); cells sorted by that distance; Newton with a hard clip to [0,1]^3, at most 10 iterations, until the point
// is within `threshold_mm`; l first, then L.
// Coherence: Newton from the parameters of the voxels already solved around (the four before it on this and the
// previous line), the full search only if none of them leads to the point.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice::oracle {

/// What Algorithm 1 knows of a solid. Implementations may keep scratch memory: one per thread.
class Algorithm1Solid {
 public:
  virtual ~Algorithm1Solid() = default;
  /// By cell: boxes of the control points of its one-ring, and of its own corners.
  virtual std::span<const Box3> ring_boxes() const = 0;
  virtual std::span<const Box3> corner_boxes() const = 0;
  virtual Vec3 geo(const CellParam& at) = 0;
  virtual void geo_and_jacobian(const CellParam& at, Vec3& position, Mat3& jacobian) = 0;
};

struct Algorithm1Options {
  double threshold_mm = 1e-3;  // The paper's.
  int max_iterations = 10;
  double smallest_step = 1e-12;  // Stopping criterion: a step shorter than this in parameter and geometry space.
};

class Algorithm1 {
 public:
  explicit Algorithm1(Algorithm1Solid& solid, const Algorithm1Options& options = {});

  /// Lines 1-13 of the pseudo-code.
  std::optional<CellParam> invert(const Vec3& point);

  /// Inverts the points of one grid line after the other, reusing the neighbours' parameters. `inside[x]` says which
  /// voxels of the line are wanted; `line[x]` gets their parameters (nothing where the search fails or none is wanted).
  /// `previous`: the line before, or empty.
  void invert_line(std::span<const Vec3> points, const std::vector<bool>& inside,
                   std::span<const std::optional<CellParam>> previous, std::span<std::optional<CellParam>> line);

  std::size_t full_inversions() const { return full_inversions_; }
  std::size_t coherent_inversions() const { return coherent_inversions_; }

 private:
  struct Candidate {
    LimitCellId cell;
    Vec3 start;
    double distance2;
  };
  /// Line 3.
  void add_candidate(LimitCellId cell, const Vec3& point);
  /// Lines 2-13 over the candidates.
  std::optional<CellParam> trace(const Vec3& point);
  /// Lines 4-11.
  std::optional<CellParam> newton(const CellParam& start, const Vec3& point);

  Algorithm1Solid& solid_;
  Algorithm1Options options_;
  std::vector<LimitCellId> ring_cells_;  // The list L.
  std::vector<Candidate> candidates_;
  std::size_t full_inversions_ = 0, coherent_inversions_ = 0;
};

}  // namespace ccslice::oracle
