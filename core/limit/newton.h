// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Newton's method in one cell [Luu19, 3.2.2], kept inside [0,1]^3.
//
// The paper clips a step to the cell, which lands on the singular lines of irregular cells, where the Jacobian is
// singular or unbounded. Here a step may not take a coordinate below a tenth of its old value, likewise at 1.
// Coordinates that are held back leave the linear system, and the others are solved again in the least-squares sense,
// so that the iteration slides along a face to the nearest parameter when the point lies outside. Regular cells have no
// singular lines: they clip at 0 and 1.

#pragma once

#include "core/limit/acceptance.h"
#include "core/limit/limit_evaluator.h"

namespace ccslice {

struct NewtonResult {
  Vec3 uvw = Vec3::Zero();
  double residual_mm = 0;
  int steps = 0;
  bool accepted = false;
};

/// When to give a cell up: after so many steps in a row that were held back at a face and gained less than a tenth.
enum class Patience : int { kQuick = 1, kLong = 4 };

/// Stops when the residual is accepted, or when it stagnates. Beside singular lines, where long ways in parameters are
/// short ones in space, it goes on until the steps are short as well. Always returns the best parameter met.
NewtonResult newton_in_cell(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& start, const Vec3& point,
                            const Acceptance& acceptance, Patience patience = Patience::kLong) noexcept;

}  // namespace ccslice
