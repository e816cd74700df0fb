// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <sys/stat.h>

#include <array>
#include <cstdint>
#include <string>

namespace ccslice::server {

/// Differs once a file has been written or another one has taken its place: inode, size, time of change.
using FileVersion = std::array<std::int64_t, 4>;

/// Zeros if there is no such file.
[[nodiscard]] inline FileVersion file_version(const std::string& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) return {};
  return {static_cast<std::int64_t>(status.st_ino), static_cast<std::int64_t>(status.st_size), status.st_mtim.tv_sec,
          status.st_mtim.tv_nsec};
}

}  // namespace ccslice::server
