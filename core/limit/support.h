// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "core/base/cancellation.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {

/// The support function of the limit volume: max over its points p of direction . p, to 1e-10 of the hull's extent
/// along `direction`. Branch and bound over the boundary's Bezier nets; pure.
/// Throws Error{kCancelled}.
double support(const BoundarySurface& surface, const Vec3& direction, const CancellationToken& cancel = {});

}  // namespace ccslice
