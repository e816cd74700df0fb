// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ZIP archives, written by minizip. All entries are of 1 January 1980, the earliest that there is, so equal contents
// are equal archives.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "client/cli/base/output_file.h"

namespace ccslice::cli {

class ZipFile {
 public:
  /// All throw Error{kFileUnwritable}.
  explicit ZipFile(const std::filesystem::path& path);
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  /// Adds the bytes without compressing them: for contents that are compressed already. REQUIRES: less than 4 GiB.
  void add_stored(const std::string& name, std::string_view bytes);
  void add_compressed(const std::string& name, std::string_view bytes);
  /// Completes the archive, which appears only now. Returns its size.
  std::uint64_t finish();

 private:
  enum class Method { kStored, kDeflated };
  void add(const std::string& name, std::string_view bytes, Method method);
  [[noreturn]] void fail() const;

  const std::filesystem::path path_;
  NewFile file_;
  void* zip_ = nullptr;  // minizip's.
};

}  // namespace ccslice::cli
