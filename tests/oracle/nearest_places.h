// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The places of a solid that are nearest to a point off it, found the slow way: in every cell that may come near, from
// many starts, by Gauss-Newton steps along the sides that the point is beyond, halved until they lead nearer.

#pragma once

#include <vector>

#include "core/limit/limit_evaluator.h"

namespace ccslice::oracle {

struct NearPlace {
  CellParam at;
  Vec3 position = Vec3::Zero();  // mm, mesh frame.
  double distance_mm = 0;
};

/// One for each cell whose box comes within `within_mm`, the nearest first.
std::vector<NearPlace> nearest_places(LimitEvaluator& evaluator, const Vec3& point, double within_mm);

}  // namespace ccslice::oracle
