// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How much of a part a volume has no samples for: a scan beside it is seldom meant.

#pragma once

#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/limit/limit_solid.h"
#include "core/volume/volume_source.h"

namespace ccslice {

/// The share of the part's volume that has each source's value outside, estimated at a few thousand points. Takes some
/// milliseconds. Throws Error{kCancelled}.
std::vector<double> shares_outside(std::span<const VolumeSource* const> sources, const LimitSolid& solid,
                                   const Placement& placement, const CancellationToken& cancel = {});

}  // namespace ccslice
