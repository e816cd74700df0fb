// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Random printable materials for a job: a palette, maps of every kind, for all or by cell region, and how materials
// are chosen; and planes that show them, the cell regions, or channels with a sample of their own outside.

#pragma once

#include <string>

#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "tests/oracle/hostile/hostile_random.h"

namespace ccslice::oracle {

/// Adds planes before the job's last, which stays the last, and to some planes of channels a sample for voxels outside.
/// Some jobs that print show no channels any more, so that the maps alone say how far those may be off. Returns what
/// was added, in one line. REQUIRES: a channel at least.
std::string add_hostile_planes(HostileRandom& random, const SolidSummary& solid, SliceJob& job);

}  // namespace ccslice::oracle
