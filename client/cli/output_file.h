// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Output files that are whole or absent, and never overwrite anything unless the user says so.

#pragma once

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
  /// Where it is until it is finished: for a library that writes it itself.
  const std::filesystem::path& temporary() const { return temporary_; }
  void finish();
  /// Finishes the file and waits until its name and its contents are on the disk, so that they survive a crash.
  void finish_on_disk();

 private:
  const std::filesystem::path path_, temporary_;
  std::ofstream file_;
};

void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Writes the whole file, and returns when it is on the disk as after NewFile::finish_on_disk().
void write_file_on_disk(const std::filesystem::path& path, std::string_view bytes);

/// Waits until all that was written to the folder's file system is on the disk. Throws Error{kFileUnwritable}.
void sync_folder(const std::filesystem::path& folder);

/// Throws Error{kFileUnwritable} if there is something at `path`, unless `force`.
void refuse_to_overwrite(const std::filesystem::path& path, bool force);

}  // namespace ccslice::cli
