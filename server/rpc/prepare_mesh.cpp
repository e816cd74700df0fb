// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/prepare_mesh.h"

#include <chrono>
#include <utility>

#include "server/rpc/convert.h"

namespace ccslice::server {

PreparedMesh prepare_mesh(Upload& upload, const MeshLimits& limits, const CancellationToken& cancel) {
  const auto start = std::chrono::steady_clock::now();
  PreparedMesh prepared;
  prepared.serialized_bytes = upload.bytes().size();
  ControlMesh mesh = parse_control_mesh(upload.bytes());
  upload.release();
  prepared.solid = LimitSolid::prepare(std::move(mesh), {.limits = limits, .cancel = cancel});
  prepared.memory_bytes = prepared.solid->summary().memory_bytes;
  prepared.preparation_time = std::chrono::steady_clock::now() - start;
  return prepared;
}

}  // namespace ccslice::server
