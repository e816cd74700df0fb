// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What is at single points of the world: their parameters in a placed solid, and the channels there. They are inverted
// as a layer's voxels are (material_field.h), but lie anywhere: most of them often outside, and hardly two of them in
// one patch. So a batch of them is solved cell by cell, and what is nowhere is proved to be
// (inversion/point_inverter.h).
//
// An answer depends on its point alone: not on the others of its batch, nor on what was asked before.

#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/inversion/point_inverter.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct ProbedPoint {
  CellParam at;
  double residual_mm = 0;          // Between the point and what its parameter maps to, in the world.
  double largest_residual_mm = 0;  // At most that: by the placement's largest scale, as in MaterialField.
  std::span<const double> channels;
};

/// One thread.
class PointProbe {
 public:
  /// `outside_mm`: points so far off the solid still get the nearest parameter found, world mm. REQUIRES: placement
  /// passes validate_placement().
  PointProbe(std::shared_ptr<const LimitSolid> solid, const Placement& placement, double outside_mm);

  using OnFound = std::function<void(std::size_t point, const ProbedPoint& found)>;
  /// Calls on_found() for each point that has a parameter, in any order. Throws Error{kCancelled} and what on_found()
  /// throws.
  void probe(std::span<const Vec3> world, const OnFound& on_found, const CancellationToken& cancel);

 private:
  std::shared_ptr<const LimitSolid> solid_;
  Placement placement_, mesh_of_world_;
  Vec3 scales_;  // Singular values of the placement, largest first.
  PointInverter inverter_;
  std::vector<Vec3> points_;  // Mesh frame.
  std::vector<double> channels_;
};

}  // namespace ccslice
