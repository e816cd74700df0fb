// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Colours for numbers, from the lowest to the highest. Viridis and cividis rise evenly in lightness, so that they read
// in grey too; cividis looks nearly the same to people who can't tell red from green.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace ccslice {

enum class ColourMapName : std::uint8_t { kViridis, kCividis, kGrey };

struct ColourMapTraits {
  ColourMapName map;
  std::string_view name;  // Of the contract's value, without COLOUR_MAP_NAME_.
};

inline constexpr std::array kColourMaps = {
    ColourMapTraits{.map = ColourMapName::kViridis, .name = "VIRIDIS"},
    ColourMapTraits{.map = ColourMapName::kCividis, .name = "CIVIDIS"},
    ColourMapTraits{.map = ColourMapName::kGrey, .name = "GREY"},
};

using Srgb = std::array<std::uint8_t, 3>;  // Red, green, blue.

/// What material is drawn in that has no channel to be coloured by.
inline constexpr Srgb kPlainMaterialColour = {237, 158, 64};

/// The colour of a share of the range, clamped to [0, 1]; no number counts as 0.
Srgb map_colour(ColourMapName map, double share) noexcept;

}  // namespace ccslice
