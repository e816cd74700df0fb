// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From the tolerance of a job, a share of what each plane shows, to lengths in the units of channels. One polynomial a
// channel serves all planes, so the strictest plane counts.

#pragma once

#include <span>
#include <vector>

#include "core/interpolation/interpolation_spec.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// The channels that a job's planes show or are made of, each once, by how much each may be off: the strictest that
/// any of the planes asks for. `channels`: the solid's. REQUIRES: job.material_tolerance isn't 0.
std::vector<ChannelTolerance> channel_tolerances(const SliceJob& job, std::span<const ChannelRange> channels);

}  // namespace ccslice
