// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/load_mesh.h"

#include <utility>

#include "core/base/error.h"
#include "server/rpc/prepare_mesh.h"
#include "server/service/mesh_id.h"
#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

ServiceError missing_mesh(const std::string& mesh_id) {
  return ServiceError(ServiceErrorCode::kMeshMissing,
                      "this server doesn't hold the mesh " + mesh_id + ": upload it, then repeat the call", "",
                      mesh_id);
}

}  // namespace

MeshPtr find_mesh(ServiceState& state, const std::string& mesh_id) {
  require_mesh_id(mesh_id, "mesh_id");
  MeshPtr mesh = state.cache.find(mesh_id);
  if (!mesh && !state.store) throw missing_mesh(mesh_id);
  if (mesh && state.store) state.store->mark_used(mesh_id);
  return mesh;
}

void MeshLoad::begin(ServiceState& state, const std::string& mesh_id, const std::string& client) {
  state.store->load(mesh_id, client,
                    [self = shared_from_this(), &state, mesh_id, client](const std::shared_ptr<Upload>& upload,
                                                                         const std::exception_ptr& error) {
                      if (upload) return self->prepare(state, mesh_id, client, upload);
                      self->end(nullptr, error ? error : std::make_exception_ptr(missing_mesh(mesh_id)));
                    });
}

/// Whoever was cancelled meanwhile prepares nothing.
void MeshLoad::prepare(ServiceState& state, const std::string& mesh_id, const std::string& client,
                       const std::shared_ptr<Upload>& upload) {
  {
    const std::lock_guard lock(mutex_);
    if (!done_) return;
  }
  MeshCache::Ticket ticket = state.cache.get_or_prepare(
      mesh_id,
      // Others may hold the same bytes, for a preparation of their own if this one is cancelled.
      PreparedBytes(state, upload, /*are_kept=*/true),
      [self = shared_from_this()](const MeshCache::Outcome& outcome) { self->end(outcome.mesh, outcome.error); },
      client);
  {
    const std::lock_guard lock(mutex_);
    ticket_ = ticket;
    if (done_) return;
  }
  ticket.cancel();  // Cancelled in between; or over, when this does nothing.
}

void MeshLoad::cancel() {
  MeshCache::Ticket ticket;
  {
    const std::lock_guard lock(mutex_);
    ticket = ticket_;
  }
  ticket.cancel();
  end(nullptr, std::make_exception_ptr(Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline")));
}

void MeshLoad::end(const MeshPtr& mesh, const std::exception_ptr& error) {
  Done done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
  }
  if (done) done(mesh, error);
}

}  // namespace ccslice::server
