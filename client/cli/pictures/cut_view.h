// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A picture of a part, seen from afar along parallel rays, with a corner of it cut away.
//
// The surface is that of its triangles: shaded smoothly where it is smooth, with edges as sharp as the part has them,
// and tinted by the channel there or by the voxels at it. Where a ray leaves what is cut away inside the surface, the
// cut shows the voxels there: a channel from dark blue over green to yellow, or the colours of printed materials or of
// cell regions.

#pragma once

#include <array>
#include <optional>

#include "client/cli/pictures/picture.h"
#include "client/cli/pictures/surface_normals.h"
#include "client/cli/pictures/voxel_block.h"
#include "client/surface.h"

namespace ccslice::cli {

struct CutView {
  double azimuth_deg = -60;   // Where the viewer stands: 0 in +x, 90 in +y.
  double elevation_deg = 30;  // Above the horizon.
  /// Planes across x, y and z, each at a fraction of the part's extent. What is on the viewer's side of all of them is
  /// cut away.
  std::array<std::optional<double>, 3> cut;
  int width = 640;                                 // The width of the picture. Its height follows from the part.
  double crease_deg = SurfaceNormals::kCreaseDeg;  // Edges where the surface turns by more look sharp.
};

/// REQUIRES: the surface is closed and has a triangle, block.size > 0, view.width > 0.
Picture draw_cut_view(const client::Surface& surface, const VoxelBlock& block, const CutView& view);

}  // namespace ccslice::cli
