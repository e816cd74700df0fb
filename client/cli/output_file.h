// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace ccslice::cli {

/// A file that is there whole or not at all: written under a temporary name beside it, then renamed. All throw
/// Error{kFileUnwritable}.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path);
  /// Removes what was written unless it is finished.
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(std::string_view bytes);
  std::uint64_t size() const { return size_; }
  void finish();

 private:
  const std::filesystem::path path_, temporary_;
  std::ofstream file_;
  std::uint64_t size_ = 0;
};

void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Throws Error{kFileUnwritable} if there is something at `path`, unless `force`.
void refuse_to_overwrite(const std::filesystem::path& path, bool force);

}  // namespace ccslice::cli
