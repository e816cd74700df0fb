// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What replicas share: control meshes as they were uploaded, by id. Never prepared solids, which belong to one engine.
// Any replica may write, drop or damage an entry at any time: who reads one checks its digest.

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice::server {

enum class StoreFault {
  kRefuses,  // It is there, and takes no more, or not from us.
  kFails,    // It isn't there.
  kHangs,    // It may be there, and it cost time to find out.
};

/// The text holds no secret.
class StoreError : public std::runtime_error {
 public:
  StoreError(StoreFault fault, const std::string& text) : std::runtime_error(text), fault_(fault) {}
  StoreFault fault() const noexcept { return fault_; }

 private:
  StoreFault fault_;
};

/// One thread at a time. All throw StoreError.
class MeshStore {
 public:
  /// Takes the bytes of a mesh: how many there are, then all of them, piece by piece. Both may throw.
  struct Sink {
    std::function<void(std::uint64_t size_bytes)> begin;
    std::function<void(std::string_view piece)> append;
  };
  /// To be called after each step of what takes long.
  using Progress = std::function<void()>;

  MeshStore() = default;
  virtual ~MeshStore() = default;
  MeshStore(const MeshStore&) = delete;
  MeshStore& operator=(const MeshStore&) = delete;

  /// False if the mesh isn't there; otherwise it counts as used. Throws what the sink throws, too.
  virtual bool read(const std::string& mesh_id, const Sink& sink) = 0;
  /// In the place of what was there. Others see the old bytes, or all of the new ones.
  virtual void write(const std::string& mesh_id, const std::vector<std::string>& blocks, const Progress& progress) = 0;
  /// Whether the mesh is there; then it counts as used.
  virtual bool contains(const std::string& mesh_id) = 0;
  /// Whether it was there.
  virtual bool erase(const std::string& mesh_id) = 0;
  /// Up to so many ids, last used first.
  virtual std::vector<std::string> last_used(std::size_t count, const Progress& progress) = 0;
  /// Throws if nothing could be kept now.
  virtual void check() = 0;
};

/// Where meshes are kept: --mesh-store.
struct MeshStorePlace {
  std::string folder;  // "dir:FOLDER".
  std::string user;    // "redis://USER@HOST:PORT/DATABASE", if there is no folder. Empty: Redis' default user.
  std::string host;
  int port = 0;
  int database = 0;
};

/// Throws std::invalid_argument: what a place looks like.
[[nodiscard]] MeshStorePlace parse_mesh_store(const std::string& text);
/// As parse_mesh_store() takes it.
[[nodiscard]] std::string show_mesh_store(const MeshStorePlace& place);

struct MeshStoreOptions {
  std::optional<MeshStorePlace> place;  // None: no store.
  std::uint64_t folder_bytes = 0;       // What a folder may hold.
  std::uint64_t time_to_live_s = 0;     // In Redis, since the last use. 0: for ever.
  std::string password_file;            // Of Redis. Empty: none is asked for.
};

/// REQUIRES: options.place. Throws std::runtime_error if it can never work: a folder that takes no files, a password
/// file that can't be read. A Redis that isn't there may come yet.
[[nodiscard]] std::unique_ptr<MeshStore> open_mesh_store(const MeshStoreOptions& options);

}  // namespace ccslice::server
