// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Jobs as servers take them.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ccslice/v1/geometry.pb.h"
#include "ccslice/v1/job.pb.h"

namespace ccslice::client {

inline v1::Vector3 vector_of(double x, double y, double z) {
  v1::Vector3 vector;
  vector.set_x(x);
  vector.set_y(y);
  vector.set_z(z);
  return vector;
}

inline v1::VoxelPitch pitch_of(double x_mm, double y_mm, double z_mm) {
  v1::VoxelPitch pitch;
  pitch.set_x_mm(x_mm);
  pitch.set_y_mm(y_mm);
  pitch.set_z_mm(z_mm);
  return pitch;
}

inline v1::GridExtent extent_of(std::uint32_t columns, std::uint32_t rows, std::uint32_t layers) {
  v1::GridExtent extent;
  extent.set_columns(columns);
  extent.set_rows(rows);
  extent.set_layers(layers);
  return extent;
}

/// A job of this mesh, in this place.
inline v1::SliceJob job_of(const std::string& mesh_id, const v1::Placement& placement) {
  v1::SliceJob job;
  v1::Part& part = *job.add_parts();
  part.set_mesh_id(mesh_id);
  *part.add_placements() = placement;
  return job;
}

/// The volumes of these fields, in their order.
inline std::vector<std::string> volume_ids_of(const google::protobuf::RepeatedPtrField<v1::Field>& fields) {
  std::vector<std::string> ids;
  for (const v1::Field& field : fields) {
    if (field.has_volume()) ids.push_back(field.volume().volume_id());
  }
  return ids;
}

/// The meshes of the job's parts, in their order, then the volumes of its fields.
inline std::vector<std::string> mesh_ids_of(const v1::SliceJob& job) {
  std::vector<std::string> ids;
  for (const v1::Part& part : job.parts()) ids.push_back(part.mesh_id());
  for (const std::string& id : volume_ids_of(job.fields())) ids.push_back(id);
  return ids;
}

/// The mesh of the first part: servers are chosen by it. Empty if there is no part.
inline std::string mesh_id_of(const v1::SliceJob& job) { return job.parts().empty() ? "" : job.parts(0).mesh_id(); }

}  // namespace ccslice::client
