// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures in memory, and the colours of materials in them.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/colour_map.h"
#include "core/base/types.h"

namespace ccslice::cli {

using Colour = Vec3;  // Red, green, blue from 0 to 1.

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // Rows from the top, 3 bytes a place.
};

/// All white.
Picture blank_picture(int width, int height);

/// REQUIRES: the place is in the picture.
void set_colour(int column, int row, const Colour& colour, Picture& picture);

Colour to_colour(const Srgb& bytes);

/// The colour of a material channel from low (0) to high (1), clamped.
Colour material_colour(double t);

/// Material that has no channel to be coloured by.
inline const Colour kPlainMaterial = to_colour(kPlainMaterialColour);

/// A component from 0 to 1 (clamped) as a byte.
std::uint8_t to_byte(double component);

}  // namespace ccslice::cli
