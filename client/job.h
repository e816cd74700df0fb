// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Jobs as servers take them.

#pragma once

#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"

namespace ccslice::client {

/// A job of this mesh, in this place.
inline v1::SliceJob job_of(const std::string& mesh_id, const v1::Placement& placement) {
  v1::SliceJob job;
  v1::Part& part = *job.add_parts();
  part.set_mesh_id(mesh_id);
  *part.add_placements() = placement;
  return job;
}

/// The meshes of the job's parts, in their order.
inline std::vector<std::string> mesh_ids_of(const v1::SliceJob& job) {
  std::vector<std::string> ids;
  for (const v1::Part& part : job.parts()) ids.push_back(part.mesh_id());
  return ids;
}

/// The mesh of the first part: servers are chosen by it. Empty if there is no part.
inline std::string mesh_id_of(const v1::SliceJob& job) { return job.parts().empty() ? "" : job.parts(0).mesh_id(); }

}  // namespace ccslice::client
