// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The motion that takes points to others, by least squares. With the points' means taken out and the covariance
// H = sum to_i from_i^T = U S V^T, the orthogonal matrix of least squares is U V^T [Arun, Huang, Blostein:
// Least-squares fitting of two 3-D point sets, 1987], which mirrors where det(U V^T) < 0. The sign isn't forced to be
// positive: points of a solid aren't in one plane, so the data say which it is.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice::cli {

struct RigidFit {
  Placement placement = Placement::Identity();  // Rotates or mirrors, and moves.
  double residual_mm = 0;                       // The largest distance of a moved point from where it should be.
  std::size_t farthest = 0;                     // Its number.

  bool mirrors() const { return placement.linear().determinant() < 0; }
};

/// REQUIRES: as many points as there are in `to`, and at least one.
RigidFit fit_rigid(std::span<const Vec3> from, std::span<const Vec3> to);

/// By how much points were scaled along three axes that are perpendicular to each other, from the largest factor to the
/// smallest, and how far the best affine map leaves a point from where it should be. REQUIRES as above.
struct ScaleFit {
  Vec3 factors = Vec3::Ones();
  double residual_mm = 0;
};
ScaleFit fit_scale(std::span<const Vec3> from, std::span<const Vec3> to);

/// The placement with entries of its linear part that are next to 0, 1 and -1 made just that, about the mean of `from`,
/// if all of them are. Programs write rotations in 9 digits: a turn by 90 degrees should stay exact, since copies that
/// lie alike are sliced alike.
Placement snapped_to_axes(const Placement& placement, std::span<const Vec3> from);

}  // namespace ccslice::cli
