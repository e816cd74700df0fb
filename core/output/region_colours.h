// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Colours that tell cell regions apart in pictures.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ccslice {

/// 0xRRGGBBAA, sRGB, all different: transparent black for outside, then one for each region. The first eight are those
/// of M. Okabe, K. Ito, "Color Universal Design" (2008), which colour-blind people tell apart; then hues of the
/// golden angle. REQUIRES: regions <= 255.
std::vector<std::uint32_t> region_palette(std::size_t regions);

}  // namespace ccslice
