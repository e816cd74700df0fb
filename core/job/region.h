// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A REGION is the part of a grid that a job delivers: a box of whole voxels. It is a crop of the whole: its voxels keep
// their absolute indices, and with them their values, halftones and error diffusion included.

#pragma once

#include <cstdint>
#include <optional>

#include "core/base/types.h"
#include "core/contour/contour.h"
#include "core/contour/region_loops.h"
#include "core/job/grid.h"
#include "core/raster/layer_window.h"

namespace ccslice {

struct VoxelRegion {
  std::uint32_t first_column = 0, first_row = 0, first_layer = 0;
  GridExtent extent;

  std::uint32_t end_layer() const { return first_layer + extent.layers; }
  /// Its columns and rows.
  LayerWindow window() const { return {first_column, first_row, extent.columns, extent.rows}; }
};

/// As a client asks for it: exactly one of the two.
struct RegionRequest {
  std::optional<VoxelRegion> voxels;
  std::optional<Box3> box_mm;  // World frame: the voxels whose centres are at or above its lower corner and below its
                               // upper one. What of it is outside of the grid is left out.
};

VoxelRegion whole_region(const Grid& grid);

/// REQUIRES: a valid grid. Throws Error{kRegionAmbiguous, kRegionNonFinite, kRegionEmpty, kRegionOutOfGrid}.
VoxelRegion plan_region(const Grid& grid, const RegionRequest& request);

/// Throws Error{kRegionEmpty, kRegionOutOfGrid} unless the region has voxels, all of the grid.
void validate_region(const Grid& grid, const VoxelRegion& region);

/// Leaves out the loops whose bounding boxes don't meet the window's voxels: winding numbers there stay as they are.
void drop_loops_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<ContourLoop>& loops);
void drop_loops_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<RegionLoop>& loops);

}  // namespace ccslice
