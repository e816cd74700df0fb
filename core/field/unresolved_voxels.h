// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Voxels of one layer inside the contours that inversion didn't reach. No voxel stays without a material: each takes
// the samples of the nearest solved voxel of the layer (ties: lower row, then lower column); if the layer has none, it
// takes the nearest parameter of the whole solid.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/field/layer_target.h"
#include "core/field/material_field.h"
#include "core/raster/occupancy.h"

namespace ccslice {

class UnresolvedVoxels {
 public:
  void clear() { runs_.clear(); }
  /// REQUIRES: calls come by row, then by column.
  void add(std::uint32_t row, std::uint32_t column);

  /// Gives them their samples and counts them. `spans`: all voxels inside; those that weren't added are solved. Nothing
  /// is done if the planes hold some of them but not the whole layer: any voxel may be the nearest one.
  /// Throws Error{kCancelled}, and Error{kInternal} if even the last resort finds nothing.
  WindowOutcome fill(MaterialField& field, std::span<const VoxelRun> spans, const LayerTarget& target) const;

 private:
  void fill_from_solid(MaterialField& field, const LayerTarget& target) const;

  std::vector<VoxelRun> runs_;
};

}  // namespace ccslice
