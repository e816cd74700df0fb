// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads, validates and prepares an uploaded mesh, within the memory that the server has for it.

#pragma once

#include <cstdint>
#include <memory>

#include "core/base/cancellation.h"
#include "server/rpc/calls/service_state.h"
#include "server/service/meshes/mesh_cache.h"
#include "server/service/meshes/preparation_memory.h"
#include "server/service/meshes/upload.h"

namespace ccslice::server {

/// Prepares the bytes of a mesh: MeshCache::Prepare. Copies are of one preparation.
///
/// Reserves memory, estimated first from the bytes, then from the mesh and its refinement, and tells how far it is. As
/// it may have to begin anew, it keeps the bytes to its end, where there is room for them. Once they have been read
/// they count among the memory of preparations, no longer among that of uploads.
class PreparedBytes {
 public:
  /// `are_kept`: others keep the bytes anyway. Then they count with these.
  PreparedBytes(ServiceState& state, std::shared_ptr<Upload> upload, bool are_kept);

  /// MUST run on a worker thread. Throws Error (1xx, kCancelled), ServiceError{kMeshExceedsMemory, kServerBusy},
  /// PreparationMemory::Lack.
  PreparedMesh operator()(const CancellationToken& cancel, PreparationProgress& progress) const;

 private:
  void reserve(std::uint64_t bytes, std::uint64_t least_bytes) const;
  void reserve_when_read(std::uint64_t bytes, std::uint64_t least_bytes) const;
  [[noreturn]] void wait_for(std::uint64_t bytes) const;

  ServiceState* state_;
  std::shared_ptr<Upload> upload_;
  bool are_kept_;
  std::shared_ptr<PreparationMemory::Share> share_;
};

}  // namespace ccslice::server
