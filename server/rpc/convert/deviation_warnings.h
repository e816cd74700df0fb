// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a plan says of a limit that isn't the part that was meant.

#pragma once

#include "ccslice/v1/plan.pb.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"

namespace ccslice::server {

/// Warns if the volume of the whole changes by more than 0.5 %, or that of a cell region; a mesh that was fitted may
/// hold up to 10 % more, as it is round between its vertices. And if a vertex of the surface moves by more than half a
/// voxel. `deviation`: the placed part's.
void warn_of_deviation(const SliceJob& job, const LimitSolid& solid, const Deviation& deviation,
                       v1::PlanSlicesResponse& plan);

}  // namespace ccslice::server
