// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/prepare_mesh.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "server/rpc/mesh_reader.h"
#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

// Limit cells take 1.1 to 2.1 kB while they are made. Most hexahedra give one, a few give eight: 4 KiB are three times
// what grids of hexahedra take and a third of what the most irregular octrees do. Tetrahedra give 32, wedges 24.
constexpr std::uint64_t kHexPreparationBytes = 4 << 10;
constexpr std::uint64_t kOtherPreparationBytes = 48 << 10;
constexpr std::uint64_t kChannelValuePreparationBytes = 64;

void reserve(MemoryBudget::Share& share, std::uint64_t bytes, const MemoryBudget& budget) {
  if (bytes > budget.capacity_bytes()) {
    throw ServiceError(ServiceErrorCode::kMeshExceedsMemory,
                       "preparing the mesh takes about " + std::to_string(bytes >> 20) + " MiB, this server has " +
                           std::to_string(budget.capacity_bytes() >> 20) +
                           " for it: use a server with more memory, or split the part");
  }
  if (!share.resize(bytes)) {
    throw ServiceError(ServiceErrorCode::kServerBusy, "other meshes are being prepared: try again later");
  }
}

}  // namespace

std::uint64_t preparation_bytes(const ControlMesh& mesh) {
  std::uint64_t bytes = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    bytes += kind == CellKind::kHex ? kHexPreparationBytes : kOtherPreparationBytes;
  }
  return bytes + mesh.channel_values.size() * kChannelValuePreparationBytes;
}

PreparedMesh prepare_mesh(UploadedBytes& bytes, const MeshLimits& limits, MemoryBudget& budget,
                          const CancellationToken& cancel) {
  const auto start = std::chrono::steady_clock::now();
  MemoryBudget::Share share(budget);
  PreparedMesh prepared;
  prepared.serialized_bytes = bytes.size();
  reserve(share, kReadMemoryPerByte * bytes.size(), budget);
  ControlMesh mesh = read_control_mesh(bytes.blocks(), limits, cancel);
  bytes.release();
  reserve(share, preparation_bytes(mesh), budget);
  prepared.solid = LimitSolid::prepare(std::move(mesh), {.limits = limits, .cancel = cancel});
  prepared.memory_bytes = prepared.solid->summary().memory_bytes;
  prepared.preparation_time = std::chrono::steady_clock::now() - start;
  return prepared;
}

}  // namespace ccslice::server
