// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether a job can be sliced, before any work is spent on it.

#pragma once

#include "core/job/slice_job.h"
#include "core/job/slice_limits.h"
#include "core/job/validate_job.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// Checks a job against its solid and the limits. Throws what validate_placement(), validate_pitch() and
/// validate_extent(), validate_region() and validate_printing() throw, and Error{kNothingRequested, kTooManyPlanes,
/// kChannelUnknown, kValueRangeInvalid, kValueRangeUnexpected, kOutsideSampleInvalid, kEnumValueUnknown,
/// kEncodingUnsupported, kToleranceInvalid, kLayerBytesTooLarge}. Fields are named as in a SliceJob.
void validate_job(const LimitSolid& solid, const SliceJob& job, const SliceLimits& limits = {});
void validate_job(const SolidSummary& summary, const SliceJob& job, const SliceLimits& limits = {});

}  // namespace ccslice
