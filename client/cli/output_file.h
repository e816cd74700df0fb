// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string_view>

namespace ccslice::cli {

/// Writes a file so that it is there whole or not at all: under a temporary name beside it, then renamed. Throws
/// Error{kFileUnwritable}.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Throws Error{kFileUnwritable} if there is something at `path`, unless `force`.
void refuse_to_overwrite(const std::filesystem::path& path, bool force);

}  // namespace ccslice::cli
