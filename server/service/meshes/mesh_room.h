// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Room in the cache where all of it is in use, though not by anybody who works: a preview whose client went for lunch,
// or a stream that isn't read, keeps its mesh for as long as it may be silent. And one that reads a message every few
// seconds would keep it for ever.

#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/service/meshes/mesh_cache.h"
#include "server/service/scheduling/idle_watch.h"

namespace ccslice::server {

/// How long a client is silent before its mesh may have to go.
inline constexpr std::chrono::milliseconds kSilentWithMesh{10'000};
/// How long it is where others have been refused again and again: its calls have shed all else by then.
inline constexpr std::chrono::milliseconds kLagsWithMesh{1'000};

/// Clients who find no room for their meshes. Not thread-safe.
class RefusedClients {
 public:
  using Clock = std::chrono::steady_clock;

  /// `wait`: how long a client is refused before others' slow readers make room for it.
  explicit RefusedClients(std::chrono::milliseconds wait) : wait_(wait) {}
  /// A client is refused now. How long others must have been silent for its sake.
  [[nodiscard]] std::chrono::milliseconds least_silence(const std::string& client, Clock::time_point now);

 private:
  struct Refusals {
    Clock::time_point first, last;
  };

  const std::chrono::milliseconds wait_;
  std::map<std::string, Refusals> refusals_;
};

/// Ends calls among `calls` whose meshes leave no room for `refused`, and says how many: of meshes all of whose clients
/// have been silent for `silent`, the most silent ones first, as many as give the bytes that are missing. None, if they
/// don't. Calls of others aren't ended for a client whose meshes in use would then be more than theirs are.
std::size_t make_room_for(const RefusedMesh& refused, const std::vector<std::shared_ptr<IdleCall>>& calls,
                          std::chrono::milliseconds silent = kSilentWithMesh);

}  // namespace ccslice::server
