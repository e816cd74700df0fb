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

/// `bytes` are what is known so far: a preparation asks for more as it goes on.
void reserve(MemoryBudget::Share& share, std::uint64_t bytes, const MemoryBudget& budget) {
  constexpr std::uint64_t kMiB = 1 << 20;
  if (bytes > budget.capacity_bytes()) {
    throw ServiceError(ServiceErrorCode::kMeshExceedsMemory,
                       "preparing the mesh takes at least " + std::to_string((bytes + kMiB - 1) / kMiB) +
                           " MiB ('ccslice info' says how much in all), this server has " +
                           std::to_string(budget.capacity_bytes() / kMiB) +
                           " for it (--preparation-budget-bytes): ask its operator for more, use another server, or "
                           "split the part");
  }
  if (!share.resize(bytes)) {
    throw ServiceError(ServiceErrorCode::kServerBusy, "other meshes are being prepared: try again later");
  }
}

}  // namespace

PreparedMesh prepare_mesh(ServiceState& state, const UploadedBytes& bytes, const std::function<void()>& when_read,
                          const CancellationToken& cancel, PreparationProgress& progress) {
  const MeshLimits& limits = state.mesh_limits;
  MemoryBudget& budget = state.preparations;
  const int threads = std::max(1, static_cast<int>(state.executor.threads()) - 1);  // One stays free of preparations.
  const auto start = std::chrono::steady_clock::now();
  MemoryBudget::Share share(budget);
  progress.begin(PreparationStep::kReading);
  PreparedMesh prepared;
  prepared.serialized_bytes = bytes.size();
  reserve(share, kReadMemoryPerByte * bytes.size(), budget);
  ControlMesh mesh = read_control_mesh(bytes.blocks(), limits, cancel);
  when_read();
  PrepareOptions options{.limits = limits, .cancel = cancel, .threads = threads, .reserve = {}, .progress = &progress};
  options.reserve = [&](std::uint64_t needed) { reserve(share, needed, budget); };
  prepared.solid = LimitSolid::prepare(std::move(mesh), options);
  prepared.memory_bytes = prepared.solid->summary().memory_bytes;
  prepared.preparation_time = std::chrono::steady_clock::now() - start;
  return prepared;
}

}  // namespace ccslice::server
