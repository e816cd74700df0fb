// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ZIP archives of others, read by minizip. Nothing is unpacked onto the disk, and what is unpacked into memory is
// bounded: an archive of zeros is a thousand times smaller than what it claims to hold.

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace ccslice::cli {

class ZipReader {
 public:
  /// Reads the list of entries. `max_bytes`: of the archive, and of all that is unpacked. Throws
  /// Error{kFileUnreadable, kFileSyntax, kMeshTooLarge}, with the file's name.
  ZipReader(const std::filesystem::path& path, std::uint64_t max_bytes);
  ~ZipReader();
  ZipReader(const ZipReader&) = delete;
  ZipReader& operator=(const ZipReader&) = delete;

  /// Names are compared without regard to the case of letters A to Z, as packages have it [OPC, 6.2.2.3].
  bool has(const std::string& name) const;
  /// The bytes of an entry. Throws Error{kMeshTooLarge, kFileSyntax}. REQUIRES: has(name).
  std::string read(const std::string& name);

 private:
  struct Entry {
    std::uint64_t at = 0, number = 0;  // minizip's position.
    std::uint64_t bytes = 0;           // As the archive says.
  };
  void list();
  void add_entry();
  [[noreturn]] void fail(const std::string& what) const;

  const std::string path_;
  const std::uint64_t max_bytes_;
  std::uint64_t unpacked_ = 0;
  std::map<std::string, Entry> entries_;  // By names in lower case.
  void* zip_ = nullptr;                   // minizip's.
};

}  // namespace ccslice::cli
