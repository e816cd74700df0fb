// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/prepare_mesh.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "core/mesh/validate.h"
#include "core/prepare/prepare_solid.h"
#include "server/rpc/convert/mesh_reader.h"
#include "server/rpc/convert/volume_reader.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

/// `bytes` are what is known so far: a preparation asks for more as it goes on.
void require_capacity(std::uint64_t bytes, const MemoryBudget& budget) {
  constexpr std::uint64_t kMiB = 1 << 20;
  if (bytes <= budget.capacity_bytes()) return;
  throw ServiceError(ServiceErrorCode::kMeshExceedsMemory,
                     "preparing the mesh or volume takes at least " + std::to_string((bytes + kMiB - 1) / kMiB) +
                         " MiB ('ccslice info' says how much in all), this server has " +
                         std::to_string(budget.capacity_bytes() / kMiB) +
                         " for it (--preparation-budget-bytes): ask its operator for more, use another server, or "
                         "split the part");
}

}  // namespace

PreparedBytes::PreparedBytes(ServiceState& state, std::shared_ptr<Upload> upload, bool are_kept)
    : state_(&state),
      upload_(std::move(upload)),
      are_kept_(are_kept),
      share_(std::make_shared<PreparationMemory::Share>(state.preparation_memory)) {}

PreparedMesh PreparedBytes::operator()(const CancellationToken& cancel, PreparationProgress& progress) const {
  const MeshLimits& limits = state_->mesh_limits;
  const int threads = std::max(1, static_cast<int>(state_->executor.threads()) - 1);  // One stays free of preparations.
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t waited_for = share_->bytes();  // Of an attempt before.
  progress.begin(PreparationStep::kReading);
  PreparedMesh prepared;
  prepared.serialized_bytes = upload_->bytes().size();
  if (holds_volume(upload_->bytes().blocks())) {
    reserve(kVolumeReadingBytes, waited_for);
    const auto reserve_samples = [&](std::uint64_t bytes) { reserve(bytes + kVolumeReadingBytes, waited_for); };
    prepared.volume = std::make_shared<const Volume>(read_volume(upload_->bytes().blocks(), reserve_samples, cancel));
    prepared.memory_bytes = prepared.volume->memory_bytes();
    prepared.preparation_time = std::chrono::steady_clock::now() - start;
    return prepared;
  }
  reserve(kReadMemoryPerByte * prepared.serialized_bytes, waited_for);
  ControlMesh mesh = read_control_mesh(upload_->bytes().blocks(), limits, cancel);
  PrepareOptions options{.limits = limits, .cancel = cancel, .threads = threads, .reserve = {}, .progress = &progress};
  options.reserve = [&](std::uint64_t needed) { reserve_when_read(needed, waited_for); };
  prepared.solid = prepare_solid(std::move(mesh), options);
  prepared.memory_bytes = prepared.solid->summary().memory_bytes;
  prepared.preparation_time = std::chrono::steady_clock::now() - start;
  return prepared;
}

/// Keeps `least_bytes`, for what follows.
void PreparedBytes::reserve(std::uint64_t bytes, std::uint64_t least_bytes) const {
  require_capacity(bytes, state_->preparations);
  if (!share_->resize(std::max(bytes, least_bytes))) wait_for(bytes);
}

void PreparedBytes::reserve_when_read(std::uint64_t bytes, std::uint64_t least_bytes) const {
  UploadedBytes& uploaded = upload_->bytes();
  if (are_kept_ || uploaded.size() == 0) return reserve(bytes, least_bytes);
  const std::uint64_t capacity = state_->preparations.capacity_bytes();
  require_capacity(bytes, state_->preparations);
  const std::uint64_t with_uploaded = bytes + uploaded.size();
  if (with_uploaded <= capacity && share_->resize(std::max(with_uploaded, least_bytes))) return uploaded.leave_budget();
  if (with_uploaded <= capacity || !share_->resize(std::max(bytes, least_bytes))) wait_for(with_uploaded);
  uploaded.release();  // It has nearly all there is.
}

/// Somewhat more than what is known so far: else it might have to begin anew a few times.
void PreparedBytes::wait_for(std::uint64_t bytes) const {
  const bool has_bytes = upload_->bytes().size() > 0 && upload_->bytes().enter_budget();
  if (has_bytes) {
    throw PreparationMemory::Lack{share_, std::min(bytes + bytes / 8, state_->preparations.capacity_bytes())};
  }
  throw ServiceError(ServiceErrorCode::kServerBusy, "other meshes are being prepared: try again later");
}

}  // namespace ccslice::server
