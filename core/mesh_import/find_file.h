// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files that others name as Windows does: with backslashes between folders, and in any case of letters.

#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace ccslice {

/// The files that `name` may stand for, beside the files of `folder`: the one of just this name if there is one; with
/// backslashes as separators; in other cases of letters (ASCII), sorted. None if there are none.
std::vector<std::filesystem::path> find_files(const std::filesystem::path& folder, std::string_view name);

}  // namespace ccslice
