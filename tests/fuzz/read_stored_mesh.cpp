// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// An entry of a mesh store with arbitrary bytes: the mesh that it is named after, or none, and then no entry either.

#include <cstdint>
#include <cstdlib>
#include <future>
#include <memory>
#include <string>
#include <string_view>

#include "server/service/meshes/folder_store.h"
#include "server/service/meshes/mesh_id.h"
#include "server/service/meshes/stored_meshes.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace ccslice::server;

constexpr std::uint64_t kMostBytes = 1 << 20;

struct Fixture {
  ccslice::TemporaryFolder folder;
  MemoryBudget budget{4 * kMostBytes};
  StoredMeshes stored{
      std::make_unique<FolderStore>(folder.path(), 16 * kMostBytes), budget, {.max_mesh_bytes = kMostBytes}};
};

bool is_found(Fixture& fixture, const std::string& id) {
  std::promise<bool> found;
  fixture.stored.load(id, "client", [&](const std::shared_ptr<Upload>& upload, const std::exception_ptr&) {
    found.set_value(upload != nullptr);
  });
  return found.get_future().get();
}

bool is_held(Fixture& fixture, const std::string& id) {
  std::promise<bool> held;
  fixture.stored.find({id}, "client",
                      [&](const std::vector<bool>& answers) { held.set_value(!answers.empty() && answers[0]); });
  return held.get_future().get();
}

}  // namespace

/// The first byte says whether the entry is named after the bytes, or after others.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Fixture fixture;
  if (size < 2 || size > kMostBytes) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const bool is_own = data[0] % 2 == 0;
  const std::string id = mesh_id_of(is_own ? bytes : bytes + "x");
  FolderStore(fixture.folder.path(), 16 * kMostBytes).write(id, {bytes}, [] {});
  if (is_found(fixture, id) != is_own || is_held(fixture, id) != is_own) std::abort();
  (void)FolderStore(fixture.folder.path(), 16 * kMostBytes).erase(id);
  return fixture.budget.used_bytes() == 0 ? 0 : (std::abort(), 0);
}
