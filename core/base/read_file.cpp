// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/read_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice {

std::string read_file_bytes(const std::string& path, std::uint64_t max_bytes) {
  constexpr std::size_t kMostShown = 4096;  // As long as paths are.
  const std::string shown = echoed(path, kMostShown);
  std::error_code status;
  const std::filesystem::file_type type = std::filesystem::status(path, status).type();
  if (type == std::filesystem::file_type::directory) {
    throw Error(ErrorCode::kFileUnreadable, shown + " is a folder, not a file");
  }
  if (type == std::filesystem::file_type::character || type == std::filesystem::file_type::block) {
    throw Error(ErrorCode::kFileUnreadable, shown + " is a device, not a file");
  }
  const auto refuse = [&] {
    throw Error(ErrorCode::kMeshTooLarge, shown + " has more than " + std::to_string(max_bytes) + " bytes");
  };
  std::uint64_t size = type == std::filesystem::file_type::regular ? std::filesystem::file_size(path, status) : 0;
  if (status) size = 0;
  if (size > max_bytes) refuse();
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorCode::kFileUnreadable, "cannot open " + shown + ": " + std::strerror(errno));
  std::string bytes;
  bytes.reserve(size);
  std::vector<char> block(1 << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0) {
    bytes.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > max_bytes) refuse();
  }
  if (file.bad()) throw Error(ErrorCode::kFileUnreadable, "cannot read " + shown + ": " + std::strerror(errno));
  return bytes;
}

}  // namespace ccslice
