// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The one part of a job, made where there is none yet.

#pragma once

#include "ccslice/v1/job.pb.h"

namespace ccslice {

inline v1::Part& part_of(v1::SliceJob& job) { return job.parts().empty() ? *job.add_parts() : *job.mutable_parts(0); }

inline v1::Placement& placement_of(v1::SliceJob& job) {
  v1::Part& part = part_of(job);
  return part.placements().empty() ? *part.add_placements() : *part.mutable_placements(0);
}

}  // namespace ccslice
