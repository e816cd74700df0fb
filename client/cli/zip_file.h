// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ZIP archives (APPNOTE 6.3), with the 64-bit records where there are more than 65,534 entries or 4 GiB. All entries
// are of 1 January 1980, the earliest that there is, so equal contents are equal archives.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "client/cli/output_file.h"

namespace ccslice::cli {

class ZipFile {
 public:
  /// All throw Error{kFileUnwritable}.
  explicit ZipFile(const std::filesystem::path& path) : file_(path) {}

  /// As it is: for what is compressed already. REQUIRES: less than 4 GiB.
  void add_stored(const std::string& name, std::string_view bytes);
  void add_compressed(const std::string& name, std::string_view bytes);
  /// The archive isn't there before. Returns its size.
  std::uint64_t finish();

 private:
  void add(const std::string& name, std::string_view bytes, std::string_view packed, std::uint16_t method);

  NewFile file_;
  std::string directory_;
  std::uint64_t entries_ = 0;
};

}  // namespace ccslice::cli
