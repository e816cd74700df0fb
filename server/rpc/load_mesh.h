// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A mesh that a call names: from the cache, or from the store that replicas share, by way of the cache.

#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "server/rpc/service_state.h"

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

/// The cached mesh, marked as used; null if it has to be loaded. Throws ServiceError{kMeshIdInvalid}, and kMeshMissing
/// where there is no store to load it from.
[[nodiscard]] MeshPtr find_mesh(ServiceState& state, const std::string& mesh_id);

}  // namespace ccslice::server
