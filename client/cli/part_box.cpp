// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/part_box.h"

namespace ccslice::cli {

v1::Box3 part_box(Session& session, const std::string& mesh_id, const v1::Placement& placement) {
  v1::PlanSlicesRequest request;
  request.set_mesh_id(mesh_id);
  *request.mutable_placement() = placement;
  // Any grid does: only the box is wanted. One voxel of the largest pitch is always within the limits.
  const double pitch = session.server_info().slice_limits().max_pitch_mm();
  request.mutable_grid()->mutable_pitch()->set_x_mm(pitch);
  request.mutable_grid()->mutable_pitch()->set_y_mm(pitch);
  request.mutable_grid()->mutable_pitch()->set_z_mm(pitch);
  return session.client().plan(request, session.call()).grid().part_box();
}

}  // namespace ccslice::cli
