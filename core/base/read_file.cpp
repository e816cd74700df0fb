// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/read_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "core/base/error.h"

namespace ccslice {

std::string read_file_bytes(const std::string& path, std::uint64_t max_bytes) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status)) {
    throw Error(ErrorCode::kFileUnreadable, path + " is a folder, not a file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorCode::kFileUnreadable, "cannot open " + path + ": " + std::strerror(errno));
  std::string bytes;
  std::vector<char> block(1 << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0) {
    bytes.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > max_bytes) {
      throw Error(ErrorCode::kMeshTooLarge, path + " has more than " + std::to_string(max_bytes) + " bytes");
    }
  }
  if (file.bad()) throw Error(ErrorCode::kFileUnreadable, "cannot read " + path + ": " + std::strerror(errno));
  return bytes;
}

}  // namespace ccslice
