// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A REGION is the part of a grid that a job delivers: a box of whole voxels. It is a crop of the whole: its voxels keep
// their absolute indices, and with them their values, halftones and error diffusion included.

#pragma once

#include <cstdint>

#include "core/base/types.h"
#include "core/contour/contour.h"
#include "core/contour/region_loops.h"
#include "core/job/grid.h"
#include "core/raster/layer_window.h"

namespace ccslice {

struct VoxelBox {
  std::uint32_t first_column = 0, first_row = 0, first_layer = 0;
  GridExtent extent;

  std::uint32_t end_layer() const { return first_layer + extent.layers; }
  /// Its columns and rows.
  LayerWindow window() const { return {first_column, first_row, extent.columns, extent.rows}; }
};

VoxelBox whole_region(const Grid& grid);

/// The voxels whose centres are at or above the box's lower corner and below its upper one, world frame. What of the
/// box is outside of the grid is left out. REQUIRES: a valid grid. Throws Error{kRegionNonFinite, kRegionEmpty,
/// kRegionOutOfGrid}.
VoxelBox region_of_box(const Grid& grid, const Box3& box_mm);

/// Throws Error{kRegionEmpty, kRegionOutOfGrid} unless the region has voxels, all of the grid.
void validate_region(const Grid& grid, const VoxelBox& region);

/// Leaves out the loops whose bounding boxes don't meet the window's voxels: winding numbers there stay as they are.
void drop_loops_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<ContourLoop>& loops);
void drop_loops_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<RegionLoop>& loops);

}  // namespace ccslice
