// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The voxel grid of a job: x_i = x0 + (i + 1/2) dx, y_j likewise, z_k = z0 + (k + 1/2) dz, world mm. Anchored at the
// bounding box of placement * limit volume unless the request says where: then every replica computes the same grid.
//
// By default an axis gets as many voxels as have their centre inside the box:
//
//   n = max(1, floor(length / pitch * (1 + 1e-9) + 1/2)),   length from the grid's origin to the box's upper corner.
//
// The box itself is exact to 1e-9 of its diagonal, hence the 1e-9: a centre on the upper face counts as inside, and
// rounding never takes the last voxel away.

#pragma once

#include <cstdint>
#include <optional>

#include "core/job/slice_limits.h"
#include "core/limit/limit_solid.h"
#include "core/raster/occupancy.h"

namespace ccslice {

struct VoxelPitch {
  double x_mm = 0, y_mm = 0, z_mm = 0;
};

struct GridExtent {
  std::uint32_t columns = 0, rows = 0, layers = 0;
};

struct GridRequest {
  VoxelPitch pitch;
  std::optional<Vec3> origin_mm;  // Lower corner of voxel (0,0,0). Default: the bounding box's lower corner.
  std::optional<GridExtent>
      extent;  // Default: as many voxels as have their centre within the bounding box, at least 1.
};

struct Grid {
  Vec3 origin_mm = Vec3::Zero();
  VoxelPitch pitch;
  GridExtent extent;
  Box3 part_box;  // placement * limit volume, world mm.

  /// The voxel centres of every layer.
  LayerLattice lattice() const {
    return {origin_mm.x(), origin_mm.y(), pitch.x_mm, pitch.y_mm, extent.columns, extent.rows};
  }
  double layer_z_mm(std::uint32_t layer) const { return origin_mm.z() + (layer + 0.5) * pitch.z_mm; }
};

/// Throws Error{kPitchInvalid, kPitchOutOfRange}, naming the axis, unless all three are within the limits.
void validate_pitch(const VoxelPitch& pitch, const SliceLimits& limits = {});

/// At least one voxel each way, within the limits. Throws Error{kGridExtentZero, kGridTooLarge (columns, rows),
/// kGridTooManyLayers, kGridLayerTooLarge}.
void validate_extent(const GridExtent& extent, const SliceLimits& limits = {});

/// Origin and part (if its box is known) finite and not too far out. Throws Error{kGridOriginNonFinite,
/// kGridOriginOutOfRange, kPlacementOutOfRange}.
void validate_place(const Grid& grid, const SliceLimits& limits = {});

/// Throws what the functions above and validate_placement() throw, and Error{kGridOriginNonFinite,
/// kGridOriginOutOfRange, kCancelled}.
Grid plan_grid(const LimitSolid& solid, const Placement& placement, const GridRequest& request,
               const SliceLimits& limits = {}, const CancellationToken& cancel = {});

/// The same for a part whose placed bounding box is known. REQUIRES: part_box not empty.
Grid plan_grid(const Box3& part_box, const GridRequest& request, const SliceLimits& limits = {});

}  // namespace ccslice
