// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The meshes that a call names: from the cache, or from the store that replicas share, by way of the cache.
//
// Those of a call are held all or none: where the cache is full of meshes in use, a call lets go of those that it has
// already, so calls whose meshes don't fit into it together don't keep each other from theirs for long.

#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// A mesh on its way from the store. Thread-safe.
class MeshLoad : public std::enable_shared_from_this<MeshLoad> {
 public:
  /// The mesh, or why there is none. Once, on any thread.
  using Done = std::function<void(MeshPtr mesh, std::exception_ptr error)>;

  explicit MeshLoad(Done done) : done_(std::move(done)) {}

  /// Asks the store. `client`: who the preparation is charged to.
  void begin(ServiceState& state, const std::string& mesh_id, const std::string& client);
  /// Stops waiting: `done` runs now with Error{kCancelled}, unless it ran already. Any number of times.
  void cancel();

 private:
  void prepare(ServiceState& state, const std::string& mesh_id, const std::string& client,
               const std::shared_ptr<Upload>& upload);
  void end(const MeshPtr& mesh, const std::exception_ptr& error);

  std::mutex mutex_;
  Done done_;  // Until it runs.
  MeshCache::Ticket ticket_;
};

/// The meshes of a call on their way from the store. Thread-safe.
class MeshSetLoad : public std::enable_shared_from_this<MeshSetLoad> {
 public:
  /// The meshes in the order of their ids, or why there are none. Once, on any thread.
  using Done = std::function<void(const std::vector<MeshPtr>& meshes, std::exception_ptr error)>;

  MeshSetLoad(ServiceState& state, std::vector<std::string> mesh_ids, std::string client, Done done);

  /// Asks the store for those that the cache lacks.
  void begin();
  /// Stops waiting: `done` runs with Error{kCancelled}, unless it ran already. Any number of times.
  void cancel();

 private:
  void load_missing();
  void load(const std::string& mesh_id);
  void loaded(const std::string& mesh_id, const MeshPtr& mesh);
  void failed(const std::exception_ptr& error);
  void end(const std::vector<MeshPtr>& meshes, const std::exception_ptr& error);

  /// What was there until it was over, to be used and freed without the lock.
  struct Stopped {
    Done done;
    std::vector<MeshPtr> held;
  };
  Stopped stop(std::shared_ptr<MeshLoad>* under_way = nullptr);

  ServiceState& state_;
  const std::vector<std::string> mesh_ids_;
  const std::string client_;
  std::mutex mutex_;           // Guards what follows.
  Done done_;                  // Until it runs.
  std::vector<MeshPtr> held_;  // By number of the id; null: not yet.
  int rounds_ = 0;             // Times that they were let go.
  std::shared_ptr<MeshLoad> load_;
};

/// The cached meshes, marked as used, in the order of the ids; none if one has to be loaded. Throws
/// ServiceError{kMeshIdInvalid}, and kMeshMissing where there is no store to load it from, which names all that are.
[[nodiscard]] std::vector<MeshPtr> find_meshes(ServiceState& state, const std::vector<std::string>& mesh_ids);

}  // namespace ccslice::server
