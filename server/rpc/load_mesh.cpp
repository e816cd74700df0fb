// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/load_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "server/rpc/prepare_mesh.h"
#include "server/service/mesh_id.h"
#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

constexpr std::size_t kRounds = 3;  // Meshes of a call are loaded so often before it is given up.

/// `mesh_ids`: at least one.
ServiceError missing_meshes(const std::vector<std::string>& mesh_ids) {
  const std::string what = mesh_ids.size() == 1 ? "the mesh " + mesh_ids.front() + ": upload it"
                                                : std::to_string(mesh_ids.size()) + " of the job's meshes, " +
                                                      echoed_list(mesh_ids, mesh_ids.size()) + ": upload them";
  return ServiceError(ServiceErrorCode::kMeshMissing, "this server doesn't hold " + what + ", then repeat the call", "",
                      mesh_ids.front());
}

/// Those that the cache lacks, each once.
std::vector<std::string> missing_of(ServiceState& state, const std::vector<std::string>& mesh_ids) {
  std::vector<std::string> missing;
  for (const std::string& id : mesh_ids) {
    if (!state.cache.peek(id) && std::ranges::find(missing, id) == missing.end()) missing.push_back(id);
  }
  return missing;
}

}  // namespace

std::vector<MeshPtr> find_meshes(ServiceState& state, const std::vector<std::string>& mesh_ids) {
  std::vector<MeshPtr> meshes;
  std::vector<std::string> missing;
  for (const std::string& id : mesh_ids) {
    require_mesh_id(id, "mesh_id");
    meshes.push_back(state.cache.find(id));
    if (!meshes.back() && std::ranges::find(missing, id) == missing.end()) missing.push_back(id);
  }
  if (!missing.empty() && !state.store) throw missing_meshes(missing);
  if (!missing.empty()) return {};
  if (state.store) {
    for (const std::string& id : mesh_ids) state.store->mark_used(id);
  }
  return meshes;
}

void MeshLoad::begin(ServiceState& state, const std::string& mesh_id, const std::string& client) {
  state.store->load(mesh_id, client,
                    [self = shared_from_this(), &state, mesh_id, client](const std::shared_ptr<Upload>& upload,
                                                                         const std::exception_ptr& error) {
                      if (upload) return self->prepare(state, mesh_id, client, upload);
                      self->end(nullptr, error ? error : std::make_exception_ptr(missing_meshes({mesh_id})));
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

MeshSetLoad::MeshSetLoad(ServiceState& state, std::vector<std::string> mesh_ids, std::string client, Done done)
    : state_(state), mesh_ids_(std::move(mesh_ids)), client_(std::move(client)), done_(std::move(done)) {}

/// Of several, what the store lacks too is told before any is loaded. A store that doesn't answer lacks all.
void MeshSetLoad::begin() {
  const std::vector<std::string> missing = missing_of(state_, mesh_ids_);
  if (missing.size() < 2) return load_missing();
  state_.store->find(missing, client_, [self = shared_from_this(), missing](const std::vector<bool>& held) {
    std::vector<std::string> nowhere;
    for (std::size_t i = 0; i < missing.size(); ++i) {
      if (held.empty() || !held[i]) nowhere.push_back(missing[i]);
    }
    if (nowhere.empty()) return self->load_missing();
    self->end({}, std::make_exception_ptr(missing_meshes(nowhere)));
  });
}

/// One after the other. Each may push another one out of the cache, which is loaded again then.
void MeshSetLoad::load_missing() {
  try {
    const std::vector<std::string> missing = missing_of(state_, mesh_ids_);
    if (missing.empty()) {
      if (const std::vector<MeshPtr> meshes = find_meshes(state_, mesh_ids_); !meshes.empty())
        return end(meshes, nullptr);
    }
    if (++loads_ > kRounds * mesh_ids_.size()) {
      throw ServiceError(ServiceErrorCode::kCacheFull,
                         "the cache has no room for all " + std::to_string(mesh_ids_.size()) +
                             " meshes of the job together: try again later, or elsewhere");
    }
    load(missing.empty() ? mesh_ids_.front() : missing.front());
  } catch (...) {
    end({}, std::current_exception());
  }
}

void MeshSetLoad::load(const std::string& mesh_id) {
  const auto load =
      std::make_shared<MeshLoad>([self = shared_from_this()](const MeshPtr& mesh, const std::exception_ptr& error) {
        if (error) return self->end({}, error);
        if (self->mesh_ids_.size() == 1) return self->end({mesh}, nullptr);
        self->load_missing();
      });
  {
    const std::lock_guard lock(mutex_);
    load_ = load;
  }
  load->begin(state_, mesh_id, client_);
  const bool cancelled = [&] {
    const std::lock_guard lock(mutex_);
    return cancelled_;
  }();
  if (cancelled) load->cancel();
}

void MeshSetLoad::cancel() {
  std::shared_ptr<MeshLoad> load;
  {
    const std::lock_guard lock(mutex_);
    cancelled_ = true;
    load = load_;
  }
  if (load) load->cancel();
  end({}, std::make_exception_ptr(Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline")));
}

void MeshSetLoad::end(const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
  Done done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
  }
  if (done) done(meshes, error);
}

}  // namespace ccslice::server
