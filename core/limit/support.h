// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

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

}  // namespace ccslice
