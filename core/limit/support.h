// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far the limit volume reaches in a direction: the box of a placed part is read off its support along the axes. The
// limit lies in the hull of its control points, but well inside of it, so the hull's box would be too large.

#pragma once

#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {

/// The support function of the limit volume in each of `directions`: max over its points p of direction . p, to 1e-10
/// of the hull's extent along the direction. Branch and bound over the boundary's Bezier nets; pure. Throws
/// Error{kCancelled}.
std::vector<double> support(const BoundarySurface& surface, std::span<const Vec3> directions,
                            const CancellationToken& cancel = {});

/// Bounding box of placement * limit volume, world mm: exact to 1e-9 of the box's diagonal. Pure; takes about a
/// microsecond for every boundary face. Throws Error{kCancelled}.
Box3 bounding_box(const BoundarySurface& surface, const Placement& placement, const CancellationToken& cancel = {});
inline Box3 bounding_box(const LimitSolid& solid, const Placement& placement, const CancellationToken& cancel = {}) {
  return bounding_box(BoundarySurface(solid), placement, cancel);
}

}  // namespace ccslice
