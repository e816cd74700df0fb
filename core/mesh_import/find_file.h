// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files that others name as Windows does: with backslashes between folders, and in any case of letters.

#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// The files that `name` may stand for, beside the files of `folder`: the one of just this name if there is one; with
/// backslashes as separators; in other cases of letters (ASCII), sorted. None if there are none.
std::vector<std::filesystem::path> find_files(const std::filesystem::path& folder, std::string_view name);

/// The folders that a file may name others in: its own, origin.includes, and those below. A file that somebody sent
/// must not read others.
class NamedFiles {
 public:
  explicit NamedFiles(const FileOrigin& origin);

  struct Found {
    std::vector<std::filesystem::path> files;  // Canonical.
    bool is_outside = false;  // It would be outside: nothing says whether it's there, so nobody learns what else is.
  };
  /// Finds files as find_files() does, in those folders.
  Found find(const std::filesystem::path& folder, std::string_view name) const;

 private:
  bool may_name(const std::filesystem::path& target) const;

  std::vector<std::filesystem::path> folders_;  // Canonical.
};

}  // namespace ccslice
