// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/part_box.h"

namespace ccslice::cli {

v1::Box3 part_box(Session& session, const std::string& mesh_id, const v1::Placement& placement) {
  v1::PlanSlicesRequest request;
  *request.mutable_job() = client::job_of(mesh_id, placement);
  // Any grid does: only the box is wanted. One voxel of the largest pitch is always within the limits.
  const double mm = session.server_info().slice_limits().max_pitch_mm();
  *request.mutable_job()->mutable_grid()->mutable_pitch() = client::pitch_of(mm, mm, mm);
  return session.client().plan(request, session.call()).grid().part_box();
}

}  // namespace ccslice::cli
