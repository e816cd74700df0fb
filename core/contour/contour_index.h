// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What all parallel planes of a job share: the faces by their heights, so that a layer costs what it touches.
// Immutable; any number of tracers on any threads read it at the same time.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// "Infinitesimally above", made safe against rounding: planes are lifted by this share of the placed box's diagonal. A
/// face that lies in a plane to within rounding (1e-13 of the diagonal) is then strictly below, on every replica.
inline constexpr double kPlaneLift = 1e-10;

/// What rounding is relative to: the placed box's diagonal, or for a part far from the origin a hundredth of the
/// largest coordinate. Takes as long as many planes do. Turning the part further changes it little. Throws
/// Error{kCancelled}.
double rounding_scale_mm(const LimitSolid& solid, const Placement& placement, const CancellationToken& cancel = {});

class ContourIndex {
 public:
  /// Over all planes with this unit normal (world). REQUIRES: placement invertible. Throws Error{kCancelled}.
  ContourIndex(const LimitSolid& solid, const Placement& placement, const Vec3& normal,
               const CancellationToken& cancel = {});
  /// With a scale that is known: rounding_scale_mm() of a placement that differs by a rotation only.
  ContourIndex(const LimitSolid& solid, const Placement& placement, const Vec3& normal, double scale_mm,
               const CancellationToken& cancel = {});

  const Placement& placement() const noexcept { return placement_; }
  const Vec3& normal() const noexcept { return normal_; }
  bool mirrored() const noexcept { return mirrored_; }
  /// How far a plane is lifted, mm.
  double lift_mm() const noexcept { return kPlaneLift * scale_mm_; }
  /// Heights that computing may get wrong at most, with room: a hundredth of the lift.
  double margin_mm() const noexcept { return 0.01 * lift_mm(); }

  /// Writes the faces whose hulls may hold points at height = point . normal, in ascending order.
  void faces_at(double height_mm, std::vector<BoundaryFaceId>& faces) const;

 private:
  struct Interval {
    double low, high;  // Heights.
    double reach;      // Largest `high` of the range whose middle this is.
    BoundaryFaceId face;
  };

  double set_reach(std::size_t begin, std::size_t end);
  void find(std::size_t begin, std::size_t end, double height_mm, std::vector<BoundaryFaceId>& faces) const;

  Placement placement_;
  Vec3 normal_;
  bool mirrored_ = false;
  double scale_mm_ = 0;              // rounding_scale_mm().
  std::vector<Interval> intervals_;  // By `low`: a balanced search tree over its ranges' middles.
};

}  // namespace ccslice
