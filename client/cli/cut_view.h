// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A picture of a part made of voxels, seen from afar along parallel rays, with a corner of it cut away.
//
// A ray starts where it enters the block of voxels or where it leaves what is cut away. If it starts inside the part,
// the cut shows the material there, in colours from dark blue over green to yellow; else it goes on to the surface,
// where the smoothed occupancy is one half, which is shaded by its gradient and tinted by its material.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/types.h"

namespace ccslice::cli {

/// Cubic voxels: x fastest, then y, then z.
struct VoxelBlock {
  std::array<int, 3> size{};
  std::vector<std::uint8_t> inside;  // 1 or 0.
  std::vector<std::uint8_t> value;   // A channel from 0 to 255; all 0: no channel.

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(x);
  }
};

struct CutView {
  double azimuth_deg = -60;   // Where the viewer stands: 0 in +x, 90 in +y.
  double elevation_deg = 30;  // Above the horizon.
  /// Away goes what is on the viewer's side of all the planes that are given, each a fraction of the part's extent.
  std::array<std::optional<double>, 3> cut;
  int width = 640;  // Of the picture. Its height follows from the part.
};

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // Rows from the top, 3 bytes a place.
};

/// REQUIRES: block.size > 0, view.width > 0.
Picture draw_cut_view(const VoxelBlock& block, const CutView& view);

}  // namespace ccslice::cli
