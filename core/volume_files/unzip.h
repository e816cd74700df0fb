// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Data that gzip or zlib packed.

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ccslice {

/// Whether the bytes begin as gzip's do.
bool is_gzip(std::string_view bytes) noexcept;

/// The content of gzip's members, or of one of zlib's streams: at most `most_bytes` of it, while more may follow.
/// Memory grows as data come. Throws Error{kFileSyntax}, which says what of `what`, if they can't be unpacked or end
/// too early.
std::string unzip(std::string_view bytes, std::uint64_t most_bytes, const std::string& what);

}  // namespace ccslice
