// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/picture.h"

#include <algorithm>
#include <array>
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

Colour material_colour(double t) {
  static const std::array<Colour, 6> kColours = {Colour(0.267, 0.005, 0.329), Colour(0.254, 0.265, 0.530),
                                                 Colour(0.164, 0.471, 0.558), Colour(0.134, 0.659, 0.518),
                                                 Colour(0.478, 0.821, 0.318), Colour(0.993, 0.906, 0.144)};
  const double at = std::clamp(t, 0.0, 1.0) * (kColours.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kColours.size() - 2);
  const double f = at - static_cast<double>(i);
  return (1 - f) * kColours[i] + f * kColours[i + 1];
}

std::uint8_t to_byte(double component) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(component, 0.0, 1.0)));
}

}  // namespace ccslice::cli
