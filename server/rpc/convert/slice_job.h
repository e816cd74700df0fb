// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the plan of a job says. Pure.

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "ccslice/v1/plan.pb.h"
#include "core/base/cancellation.h"
#include "core/job/slice_job.h"
#include "core/job/slice_limits.h"
#include "core/limit/limit_solid.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

/// Tells what slicing would give. `solids`: of the job's parts; `volumes`: of its fields. Throws like
/// to_placed_parts(), and Error{kPartsOverlap}.
v1::PlanSlicesResponse plan_slices(const v1::PlanSlicesRequest& request,
                                   std::span<const std::shared_ptr<const LimitSolid>> solids, const SliceLimits& limits,
                                   const CancellationToken& cancel, const Volumes& volumes = {});

/// Samples of all planes of one layer.
std::uint64_t layer_bytes(const SliceJob& job);

}  // namespace ccslice::server
