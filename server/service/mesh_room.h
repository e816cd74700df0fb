// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Room in the cache where all of it is in use, though not by anybody who works: a preview whose client went for lunch,
// or a stream that isn't read, keeps its mesh for as long as it may be silent.

#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

#include "server/service/idle_watch.h"
#include "server/service/mesh_cache.h"

namespace ccslice::server {

/// How long a client is silent before its mesh may have to go.
inline constexpr std::chrono::milliseconds kSilentWithMesh{10'000};

/// Ends calls among `calls` whose meshes leave no room for `refused`, and says how many: of meshes all of whose clients
/// have been silent for `silent`, the most silent ones first, as many as give the bytes that are missing. None, if they
/// don't. Calls of others aren't ended for a client whose meshes in use would then be more than theirs are.
std::size_t make_room_for(const RefusedMesh& refused, const std::vector<std::shared_ptr<IdleCall>>& calls,
                          std::chrono::milliseconds silent = kSilentWithMesh);

}  // namespace ccslice::server
