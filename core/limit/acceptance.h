// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// When a parameter is near enough to the point that it is sought for.
//
// Its position is within a length of the point: but 1e-6 mm are 1e-4 of a part, or of a wall, of a hundredth of a
// millimetre, and materials follow parameters, not lengths. So the parameter must also be within kAcceptOfCell of the
// right one, in parameters of its cell. To first order that is J^-1 times what the position is off, and the position
// within kAcceptOfCell / ||J^-1||, a share of the cell's thickness. B-splines of control values in [0,1] have partial
// derivatives of at most 1, so that materials are off by at most sqrt(3) times as much, as a share of their range.
//
// None of this asks for more than doubles can tell apart, at the size of the solid and its distance from the origin.

#pragma once

#include <algorithm>

#include "core/limit/limit_solid.h"

namespace ccslice {

/// Parameters are accepted that are off by this share of their cell at most.
inline constexpr double kAcceptOfCell = 2.5e-7;

class Acceptance {
 public:
  /// `most_mm`: mesh frame. REQUIRES: the solid outlives this.
  Acceptance(const LimitSolid& solid, double most_mm);

  /// What positions may be off where this is the inverse Jacobian, by the parameters of a cell. mm.
  double at(const Mat3& inverse_jacobian) const noexcept {
    return std::clamp(kAcceptOfCell / inverse_jacobian.norm(), least_mm_, most_mm_);
  }
  /// What positions may be off in a cell, by the Jacobian in its middle. mm.
  double in_cell(LimitCellId cell) const noexcept;
  /// What positions may be off in any cell. mm.
  double most_mm() const noexcept { return most_mm_; }
  /// What doubles can reach, with room.
  double least_mm() const noexcept { return least_mm_; }

 private:
  const LimitSolid* solid_;
  double least_mm_, most_mm_;
};

}  // namespace ccslice
