// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A picture of a part made of voxels, seen from afar along parallel rays, with a corner of it cut away.
//
// A ray starts where it enters the block of voxels or where it leaves what is cut away. If it starts inside the part,
// the cut shows the material there, in colours from dark blue over green to yellow, or in that of the voxel's printed
// material; else it goes on to the surface, where the smoothed occupancy is one half, which is shaded by its gradient
// and tinted by its channel.

#pragma once

#include <array>
#include <optional>

#include "client/cli/picture.h"
#include "client/cli/voxel_block.h"

namespace ccslice::cli {

struct CutView {
  double azimuth_deg = -60;   // Where the viewer stands: 0 in +x, 90 in +y.
  double elevation_deg = 30;  // Above the horizon.
  /// Planes across x, y and z, each at a fraction of the part's extent. What is on the viewer's side of all of them is
  /// cut away.
  std::array<std::optional<double>, 3> cut;
  int width = 640;  // The width of the picture. Its height follows from the part.
};

/// REQUIRES: cubic voxels, block.size > 0, view.width > 0.
Picture draw_cut_view(const VoxelBlock& block, const CutView& view);

}  // namespace ccslice::cli
