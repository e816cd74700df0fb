// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Output files that are whole or absent, and never overwrite anything unless the user says so.

#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

namespace ccslice::cli {

/// A stream that closes itself.
using Stream = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// A file that is there whole or not at all: written under a temporary name beside it, then renamed. That name is made
/// up anew each time, and never one that is taken: whoever may write to the folder can't have it lead elsewhere. All
/// throw Error{kFileUnwritable}.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path);
  /// Removes what was written unless it is finished.
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(std::string_view bytes);
  /// For a library that writes it itself.
  std::FILE* stream() const { return stream_.get(); }
  void finish();
  /// Finishes the file and waits until its name and its contents are on the disk, so that they survive a crash.
  void finish_on_disk();

 private:
  const std::filesystem::path path_;
  std::filesystem::path temporary_;
  Stream stream_;
};

/// Removes what is being written just now, for a program that ends on the spot. No NewFile is of use any more then.
void remove_unfinished_files() noexcept;

/// What NewFile's temporary file of this name was to become; empty if `name` is none of its names.
std::string_view final_name_of_temporary(std::string_view name);

/// Opens a file for more at its end, unless it is a symbolic link. Throws Error{kFileUnwritable}.
Stream open_to_append(const std::filesystem::path& path);

void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Writes the whole file, and returns when it is on the disk as after NewFile::finish_on_disk().
void write_file_on_disk(const std::filesystem::path& path, std::string_view bytes);

/// Waits until all that was written to the folder's file system is on the disk. Throws Error{kFileUnwritable}.
void sync_folder(const std::filesystem::path& folder);

/// Throws Error{kFileUnwritable} if there is something at `path`, unless `force`.
void refuse_to_overwrite(const std::filesystem::path& path, bool force);

}  // namespace ccslice::cli
