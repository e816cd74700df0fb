// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_room.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>

namespace ccslice::server {
namespace {

struct UsedMesh {
  std::uint64_t bytes = 0;
  std::vector<IdleCall*> calls;
  std::set<std::string> clients;
  std::int64_t silent_since = 0;  // Of the client that wasn't longest.
  bool is_worked_on = false;
};

using UsedMeshes = std::map<const void*, UsedMesh>;

UsedMeshes used_meshes(const std::vector<std::shared_ptr<IdleCall>>& calls, std::int64_t before) {
  UsedMeshes meshes;
  for (const auto& call : calls) {
    const IdleCall::KeptMesh kept = call->kept_mesh();
    if (kept.mesh == nullptr) continue;
    UsedMesh& mesh = meshes[kept.mesh];
    mesh.bytes = kept.bytes;
    mesh.calls.push_back(call.get());
    mesh.clients.insert(kept.client);
    const std::int64_t since = call->silent_since();
    mesh.silent_since = std::max(mesh.silent_since, since);
    if (since <= 0 || since >= before) mesh.is_worked_on = true;
  }
  return meshes;
}

/// Meshes that may go, the most silent ones first.
std::vector<const UsedMesh*> silent_meshes(const UsedMeshes& meshes, const RefusedMesh& refused) {
  std::map<std::string, std::uint64_t> bytes_of;
  for (const auto& used : meshes) {
    for (const std::string& client : used.second.clients) bytes_of[client] += used.second.bytes;
  }
  const std::uint64_t would_have = bytes_of[refused.client] + refused.bytes;
  std::vector<const UsedMesh*> silent;
  for (const auto& used : meshes) {
    const UsedMesh& mesh = used.second;
    const bool is_fair = std::all_of(mesh.clients.begin(), mesh.clients.end(), [&](const std::string& client) {
      return client == refused.client || bytes_of[client] >= would_have;
    });
    if (is_fair && !mesh.is_worked_on) silent.push_back(&mesh);
  }
  std::sort(silent.begin(), silent.end(),
            [](const UsedMesh* a, const UsedMesh* b) { return a->silent_since < b->silent_since; });
  return silent;
}

}  // namespace

std::chrono::milliseconds RefusedClients::least_silence(const std::string& client, Clock::time_point now) {
  const auto forgotten = 3 * wait_;
  std::erase_if(refusals_, [&](const auto& each) { return now - each.second.last > forgotten; });
  Refusals& own = refusals_.try_emplace(client, Refusals{now, now}).first->second;
  own.last = now;
  return now - own.first < wait_ ? kSilentWithMesh : kLagsWithMesh;
}

std::size_t make_room_for(const RefusedMesh& refused, const std::vector<std::shared_ptr<IdleCall>>& calls,
                          std::chrono::milliseconds silent) {
  const auto before = std::chrono::steady_clock::now() - silent;
  const UsedMeshes meshes = used_meshes(calls, before.time_since_epoch().count());
  std::vector<const UsedMesh*> leaving;
  std::uint64_t bytes = 0;
  for (const UsedMesh* mesh : silent_meshes(meshes, refused)) {
    if (bytes >= refused.missing_bytes) break;
    bytes += mesh->bytes;
    leaving.push_back(mesh);
  }
  if (bytes < refused.missing_bytes) return 0;
  std::size_t ended = 0;
  for (const UsedMesh* mesh : leaving) {
    for (IdleCall* call : mesh->calls) ended += call->end_silence_begun_before(before) ? 1 : 0;
  }
  return ended;
}

}  // namespace ccslice::server
