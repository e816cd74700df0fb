// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A prepared solid as Algorithm 1 sees it: limit evaluation by the core, and the boxes that its cell lists are made of.

#pragma once

#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "tests/support/algorithm1.h"

namespace ccslice::oracle {

/// By limit cell [Luu19, Fig. 6]: the dashed green and the dashed blue line.
struct CellBoxes {
  std::vector<Box3> rings;    // Of the control points of its one-ring.
  std::vector<Box3> corners;  // Of its own eight.
};

/// Read off the rings that the core keeps.
CellBoxes cell_boxes(const LimitSolid& solid);

class LimitSolidForAlgorithm1 final : public Algorithm1Solid {
 public:
  /// REQUIRES: the solid outlives this.
  LimitSolidForAlgorithm1(const LimitSolid& solid, CellBoxes boxes) : evaluator_(solid), boxes_(std::move(boxes)) {}

  std::span<const Box3> ring_boxes() const override { return boxes_.rings; }
  std::span<const Box3> corner_boxes() const override { return boxes_.corners; }
  Vec3 geo(const CellParam& at) override { return evaluator_.geo(at); }
  void geo_and_jacobian(const CellParam& at, Vec3& position, Mat3& jacobian) override;
  LimitEvaluator& evaluator() { return evaluator_; }

 private:
  LimitEvaluator evaluator_;
  CellBoxes boxes_;
};

}  // namespace ccslice::oracle
