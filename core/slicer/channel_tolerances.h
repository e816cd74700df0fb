// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From the tolerance of a job, a share of what each plane shows, to lengths in the units of channels. One polynomial a
// channel serves all planes, so the strictest plane counts.

#pragma once

#include <vector>

#include "core/interpolation/samples/interpolation_spec.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// The solid's channels that a job's planes show or are made of, each once, by how much each may be off: the strictest
/// that any of the planes asks for; what sources read, as of planes of floats. `channels`: the solid's. REQUIRES:
/// job.channel_tolerance isn't 0.
std::vector<ChannelTolerance> channel_tolerances(const SliceJob& job, const std::vector<ChannelRange>& channels);

/// How far outside the limit volume a voxel inside the contours may lie, world mm.
double outside_mm_of(const SliceJob& job);

/// What a job's interpolation has to keep. REQUIRES: as above; some plane shows one of the
/// solid's channels or is made of one.
InterpolationSpec interpolation_spec_of(const SliceJob& job, const std::vector<ChannelRange>& channels);

}  // namespace ccslice
