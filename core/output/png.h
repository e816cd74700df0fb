// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Grey PNG files in memory. png_oiio.cpp writes them through OpenImageIO; a build without it has png_unavailable.cpp.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"

namespace ccslice {

/// Whether this build writes PNG at all.
bool png_available() noexcept;

/// `samples`: width * height grey samples of 1 byte or of 2 bytes (native order), row 0 first.
/// REQUIRES: png_available(). Throws Error{kInternal, kCancelled}.
std::vector<std::uint8_t> encode_grey_png(std::uint32_t width, std::uint32_t height, int bytes_per_sample,
                                          std::span<const std::uint8_t> samples, const CancellationToken& cancel);

}  // namespace ccslice
