// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes in a folder that replicas share:
//
//   FOLDER/3f/a0/3fa0...   the bytes of the mesh "sha256:3fa0..."; the file's time of change is that of its last use
//   FOLDER/3f/a0/.3fa0....RANDOM.tmp   one that is being written
//
// A file is written beside its place, brought to the disk, then renamed, so that readers see whole files and a crash
// leaves none that is half there. Nothing else in the folder is touched.

#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/service/meshes/mesh_store.h"

namespace ccslice::server {

class FolderStore final : public MeshStore {
 public:
  /// Makes the folder if it isn't there. `most_bytes`: beyond, the least recently used meshes go. Throws
  /// std::runtime_error if files can't be made there.
  FolderStore(std::filesystem::path folder, std::uint64_t most_bytes);

  bool read(const std::string& mesh_id, const Sink& sink) override;
  void write(const std::string& mesh_id, const std::vector<std::string>& blocks, const Progress& progress) override;
  bool contains(const std::string& mesh_id) override;
  bool erase(const std::string& mesh_id) override;
  std::vector<std::string> last_used(std::size_t count, const Progress& progress) override;
  void check() override;

 private:
  struct Entry {
    std::filesystem::path path;
    std::filesystem::file_time_type last_use;
    std::uint64_t bytes = 0;
  };

  std::filesystem::path path_of(const std::string& mesh_id) const;
  void put(const std::filesystem::path& place, const std::vector<std::string>& blocks, const Progress& progress);
  /// What is there, least recently used first. Drops what was left half written long ago.
  std::vector<Entry> scan(const Progress& progress) const;
  void make_room(std::uint64_t bytes, const Progress& progress);

  const std::filesystem::path folder_;
  const std::uint64_t most_bytes_;
  std::uint64_t held_bytes_ = 0;                          // At the last scan, and written since.
  std::chrono::steady_clock::time_point next_scan_ = {};  // Others write, too.
};

}  // namespace ccslice::server
