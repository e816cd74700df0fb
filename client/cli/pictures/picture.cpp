// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ccslice::cli {

Picture blank_picture(int width, int height) {
  constexpr std::uint8_t kWhite = 255;
  return {width, height, std::vector(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kWhite)};
}

void set_colour(int column, int row, const Colour& colour, Picture& picture) {
  std::size_t at =
      3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(column));
  for (const double component : colour) picture.rgb[at++] = to_byte(component);
}

Colour to_colour(const Srgb& bytes) {
  constexpr double kMost = 255;
  return Colour(bytes[0], bytes[1], bytes[2]) / kMost;
}

Colour material_colour(double t) { return to_colour(map_colour(ColourMapName::kViridis, t)); }

std::uint8_t to_byte(double component) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(component, 0.0, 1.0)));
}

}  // namespace ccslice::cli
