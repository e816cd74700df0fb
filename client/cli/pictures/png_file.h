// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Colour pictures as PNG files (ISO/IEC 15948), 8 bits a component.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "client/cli/pictures/picture.h"

namespace ccslice::cli {

/// The bytes of a PNG file: every row filtered by the difference to the one above it, which suits drawn pictures.
/// `level`: libdeflate's, from 1 (fast) to 12 (small).
std::string to_png(const Picture& picture, int level = 9);

/// Throws UsageError unless --output names a PNG file.
void require_png_name(const std::string& output);

/// The samples of a grey picture of 8 bits, as the server writes them: rows as they are or as differences to the row
/// above. Nothing for any other file.
[[nodiscard]] std::optional<std::string> grey_samples(std::string_view png, std::uint32_t width, std::uint32_t height);

}  // namespace ccslice::cli
