// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files as bytes.

#pragma once

#include <cstdint>
#include <string>

namespace ccslice {

/// The bytes of a file. Throws Error{kFileUnreadable}, or {kMeshTooLarge} if there are more than `max_bytes`.
std::string read_file_bytes(const std::string& path, std::uint64_t max_bytes);

}  // namespace ccslice
