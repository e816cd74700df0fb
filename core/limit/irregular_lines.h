// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The irregular lines of a limit volume: extraordinary edges and irregular boundary edges. The map from parameters to
// points is smooth everywhere else; towards these lines its derivatives vanish or grow without bound, so whoever
// interpolates over the volume has to look there.

#pragma once

#include <vector>

#include "core/base/types.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// An edge of a limit cell, or one that ends in its irregular vertex: parameters from + t * (to - from), t in [0, 1].
struct IrregularLine {
  std::uint32_t cell = 0;
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3::Zero();
};

/// Of all line and vertex cells. A line that several cells share comes once for each.
std::vector<IrregularLine> irregular_lines(const LimitSolid& solid);

/// Appends points of the line, ends included, at most about `spacing_mm` apart (mesh frame).
void append_points(const IrregularLine& line, double spacing_mm, LimitEvaluator& evaluator, std::vector<Vec3>& points);

}  // namespace ccslice
