// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Samples in a file of their own, which a header names.

#pragma once

#include <cstdint>
#include <string>

namespace ccslice {

/// The bytes of the file that a header at `path` names: one in its folder, or below. A header that somebody sent must
/// not read others. Throws Error{kFileUnreadable, kFileUnsupported, kMeshTooLarge}.
std::string read_data_file(const std::string& path, const std::string& name, std::uint64_t max_bytes);

}  // namespace ccslice
