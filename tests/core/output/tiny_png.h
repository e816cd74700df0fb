// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A PNG reader for tests, straight from the specification (chunks, zlib, the five row filters): what a picture decodes
// to must not hang on the library that wrote it.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ccslice {

struct TinyPng {
  std::uint32_t width = 0, height = 0;
  int bit_depth = 0;
  int color_type = -1;                // 0: grey, 3: indexed, 6: RGBA.
  std::vector<std::uint8_t> palette;  // Of PLTE, three bytes a colour.
  std::vector<std::uint8_t> alphas;   // Of tRNS.
  std::vector<std::uint8_t> samples;  // Rows unfiltered, otherwise as in the file: packed, 16 bits big-endian.
  std::vector<std::string> chunks;    // Names, in order.
};

/// Throws std::runtime_error for anything but a well-formed, non-interlaced file of these kinds.
TinyPng read_tiny_png(std::span<const std::uint8_t> file);

}  // namespace ccslice
