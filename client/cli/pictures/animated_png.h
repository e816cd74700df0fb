// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Animated PNG files (acTL, fcTL and fdAT chunks), made of the frames' own PNG files: their compressed pictures go on
// as they are.

#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ccslice::cli {

/// Plays the frames for so long each, over and over. REQUIRES: at least one; PNG files of one size, without palettes,
/// as PngEncoder::true_colours() makes them.
std::string animated_png(std::span<const std::string> frames, std::uint16_t frame_ms);

}  // namespace ccslice::cli
