// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/load_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "server/rpc/calls/prepare_mesh.h"
#include "server/service/base/service_error.h"
#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

constexpr int kRounds = 3;  // Meshes of a call are loaded so often before it is given up.

bool is_cache_full(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const ServiceError& failure) {
    return failure.code() == ServiceErrorCode::kCacheFull;
  } catch (...) {
    return false;
  }
}

/// `mesh_ids`: at least one.
ServiceError missing_meshes(const std::vector<std::string>& mesh_ids) {
  const std::string what = mesh_ids.size() == 1 ? "the mesh " + mesh_ids.front() + ": upload it"
                                                : std::to_string(mesh_ids.size()) + " of the job's meshes, " +
                                                      echoed_list(mesh_ids, mesh_ids.size()) + ": upload them";
  return ServiceError(ServiceErrorCode::kMeshMissing, "this server doesn't hold " + what + ", then repeat the call", "",
                      mesh_ids.front());
}

/// The ids of which `is_there(number)` says no, each once.
template <typename IsThere>
std::vector<std::string> missing_of(const std::vector<std::string>& mesh_ids, const IsThere& is_there) {
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < mesh_ids.size(); ++i) {
    if (!is_there(i) && std::ranges::find(missing, mesh_ids[i]) == missing.end()) missing.push_back(mesh_ids[i]);
  }
  return missing;
}

}  // namespace

std::vector<MeshPtr> find_meshes(ServiceState& state, const std::vector<std::string>& mesh_ids) {
  std::vector<MeshPtr> meshes;
  for (const std::string& id : mesh_ids) {
    require_mesh_id(id, "mesh_id");
    meshes.push_back(state.cache.find(id));
  }
  const std::vector<std::string> missing = missing_of(mesh_ids, [&](std::size_t i) { return meshes[i] != nullptr; });
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
    : state_(state),
      mesh_ids_(std::move(mesh_ids)),
      client_(std::move(client)),
      done_(std::move(done)),
      held_(mesh_ids_.size()) {}

/// Of several, what the store lacks too is told before any is loaded. A store that doesn't answer lacks all.
void MeshSetLoad::begin() {
  const std::vector<std::string> missing =
      missing_of(mesh_ids_, [this](std::size_t i) { return state_.cache.peek(mesh_ids_[i]).has_value(); });
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

/// One after the other.
void MeshSetLoad::load_missing() {
  std::vector<MeshPtr> all;
  std::string missing;
  {
    const std::lock_guard lock(mutex_);
    if (!done_) return;  // The server may be gone, too.
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (!held_[i]) held_[i] = state_.cache.find(mesh_ids_[i]);
      if (!held_[i] && missing.empty()) missing = mesh_ids_[i];
    }
    if (missing.empty()) all = held_;
  }
  if (!missing.empty()) return load(missing);
  for (const std::string& id : mesh_ids_) state_.store->mark_used(id);
  end(all, nullptr);
}

void MeshSetLoad::load(const std::string& mesh_id) {
  const auto load = std::make_shared<MeshLoad>(
      [self = shared_from_this(), mesh_id](const MeshPtr& mesh, const std::exception_ptr& error) {
        error ? self->failed(error) : self->loaded(mesh_id, mesh);
      });
  {
    const std::lock_guard lock(mutex_);
    if (!done_) return;
    load_ = load;
  }
  load->begin(state_, mesh_id, client_);
  const bool is_over = [&] {
    const std::lock_guard lock(mutex_);
    return !done_;
  }();
  if (is_over) load->cancel();  // Cancelled before there was anything to stop; or loaded, when this does nothing.
}

void MeshSetLoad::loaded(const std::string& mesh_id, const MeshPtr& mesh) {
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (mesh_ids_[i] == mesh_id) held_[i] = mesh;
    }
  }
  load_missing();
}

/// Where the cache is full of meshes in use, those that are held may be what keeps another call from its own.
void MeshSetLoad::failed(const std::exception_ptr& error) {
  std::vector<MeshPtr> let_go;  // Without the lock.
  {
    const std::lock_guard lock(mutex_);
    const bool holds = std::ranges::any_of(held_, [](const MeshPtr& mesh) { return mesh != nullptr; });
    if (holds && is_cache_full(error) && ++rounds_ < kRounds) {
      let_go.resize(held_.size());
      let_go.swap(held_);
    }
  }
  if (let_go.empty()) return end({}, error);
  let_go.clear();
  load_missing();
}

void MeshSetLoad::cancel() {
  std::shared_ptr<MeshLoad> load;
  const Stopped stopped = stop(&load);
  if (load) load->cancel();
  const Error error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline");
  if (stopped.done) stopped.done({}, std::make_exception_ptr(error));
}

void MeshSetLoad::end(const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
  const Stopped stopped = stop();
  if (stopped.done) stopped.done(meshes, error);
}

MeshSetLoad::Stopped MeshSetLoad::stop(std::shared_ptr<MeshLoad>* under_way) {
  Stopped stopped;
  const std::lock_guard lock(mutex_);
  stopped.done.swap(done_);
  stopped.held.resize(held_.size());
  stopped.held.swap(held_);
  if (under_way != nullptr) *under_way = load_;
  return stopped;
}

}  // namespace ccslice::server
