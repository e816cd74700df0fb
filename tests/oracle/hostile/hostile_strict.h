// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Strict maps of random jobs, which refuse values that they don't cover.

#pragma once

#include <string>

#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "tests/oracle/hostile/hostile_random.h"

namespace ccslice::oracle {

/// Makes some maps strict, half of them such that they cover the ranges of their channels. Appends what that is to the
/// text.
void draw_strict_maps(HostileRandom& random, const SolidSummary& solid, Printing& printing, std::string& text);

/// The job with maps that take any values.
SliceJob without_strict_maps(SliceJob job);

}  // namespace ccslice::oracle
