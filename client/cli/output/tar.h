// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tar archives in POSIX's format ustar, piece by piece: for each file a header, its bytes and padding; then the end.
// All entries are of 1 January 1970, of nobody in particular, so equal contents are equal archives. A library for
// archives would bring a dozen others along and slow each start of the program down, for these few lines.

#pragma once

#include <cstdint>
#include <string>

namespace ccslice::cli {

/// REQUIRES: a name of no more than 100 bytes, a size below 8 GiB.
std::string tar_header(const std::string& name, std::uint64_t size);
/// What follows a file of this size, up to a whole number of blocks.
std::string tar_padding(std::uint64_t size);
std::string tar_end();

}  // namespace ccslice::cli
