// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What tests of the client ask of a FakeSlicer.

#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "client/client.h"
#include "tests/support/job_parts.h"

namespace ccslice::client {

inline std::shared_ptr<const MeshBytes> some_mesh(int cells = 3) {
  v1::ControlMesh mesh;
  for (int i = 0; i < cells; ++i) mesh.add_cell_kinds(v1::CELL_KIND_HEX);
  for (int i = 0; i < 8 * cells; ++i) mesh.add_cell_vertices(static_cast<std::uint32_t>(i));
  return std::make_shared<const MeshBytes>(mesh);
}

inline v1::SliceRangeRequest some_request(const std::string& mesh_id, std::uint32_t first = 0,
                                          std::uint32_t count = 6) {
  v1::SliceRangeRequest request;
  part_of(*request.mutable_job()).set_mesh_id(mesh_id);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.1);
  request.set_first_layer(first);
  request.set_layer_count(count);
  for (const auto& [type, encoding] : {std::pair(v1::SAMPLE_TYPE_BIT, v1::PLANE_ENCODING_RAW_ZSTD),
                                       std::pair(v1::SAMPLE_TYPE_UINT16, v1::PLANE_ENCODING_RAW),
                                       std::pair(v1::SAMPLE_TYPE_UINT8, v1::PLANE_ENCODING_PNG)}) {
    v1::PlaneSpec& plane = *request.mutable_job()->add_planes();
    plane.mutable_occupancy();
    plane.set_sample_type(type);
    plane.set_encoding(encoding);
  }
  return request;
}

template <typename Action>
ClientError error_of(const Action& action) {
  try {
    action();
  } catch (const ClientError& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return ClientError(grpc::StatusCode::OK, "", "");
}

}  // namespace ccslice::client
