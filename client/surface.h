// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The limit surface as triangles, as it reaches the caller: complete and checked.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ccslice/v1/surface.pb.h"

namespace ccslice::client {

/// Closed: every edge belongs to two triangles, which run along it in opposite directions.
struct Surface {
  v1::TessellationHeader header;
  std::vector<std::array<double, 3>> points_mm;         // World frame.
  std::vector<float> channel_values;                    // Values of header.channels, point by point.
  std::vector<std::array<std::uint32_t, 3>> triangles;  // Counter-clockwise from outside.
};

}  // namespace ccslice::client
