// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which cell region each voxel inside belongs to: the lowest whose contours have a winding number other than zero at
// its centre. Interfaces are traced once for both regions, so a voxel beside one is in exactly one of them.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/contour/contour.h"
#include "core/raster/layer_window.h"
#include "core/raster/occupancy.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

struct RegionRun : VoxelRun {
  std::uint8_t region;
};

/// The spans, parted where regions meet; by row, then by column. `spans`: as rasterize() yields them for `rows`. Voxels
/// that rounding (1e-9 of the part) leaves in no region take that of the voxel to their left, or else to their right.
/// Throws Error{kCancelled}.
std::vector<RegionRun> find_regions(std::span<const RegionEdge> edges, std::span<const VoxelRun> spans,
                                    const LayerLattice& lattice, const RowRange& rows = {},
                                    const CancellationToken& cancel = {});

/// 1 + the region of each voxel of the window, 0 where none is inside; rows from 0 up.
void draw_regions(std::span<const RegionRun> runs, const LayerWindow& window, std::vector<std::uint8_t>& numbers);

}  // namespace ccslice
