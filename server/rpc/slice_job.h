// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From requests to jobs that the core takes, and what the plan of a job says. Pure.

#pragma once

#include <cstdint>
#include <string>

#include "ccslice/v1/job.pb.h"
#include "ccslice/v1/plan.pb.h"
#include "core/base/cancellation.h"
#include "core/job/slice_job.h"
#include "core/job/slice_limits.h"
#include "core/limit/limit_solid.h"

namespace ccslice::server {

/// The mesh of the job at `path` of a request. Throws Error{kPartsMissing, kTooManyParts},
/// ServiceError{kMeshIdInvalid}.
const std::string& mesh_id_of(const v1::SliceJob& job, const std::string& path);

/// The job at `path` of a request, valid for the solid and within the limits. Throws Error (2xx),
/// ServiceError{kRequestMalformed, kPrinterUnknown, kPrinterInvalid}. Takes a while for large meshes: throws
/// Error{kCancelled}. REQUIRES: mesh_id_of() passes.
SliceJob to_job(const v1::SliceJob& message, const std::string& path, const LimitSolid& solid,
                const SliceLimits& limits, const CancellationToken& cancel);

/// What slicing would give. Throws like to_job.
v1::PlanSlicesResponse plan_slices(const v1::PlanSlicesRequest& request, const LimitSolid& solid,
                                   const SliceLimits& limits, const CancellationToken& cancel);

/// Samples of all planes of one layer.
std::uint64_t layer_bytes(const SliceJob& job);

}  // namespace ccslice::server
