// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Copies of a part that lie alike, whole voxels apart, hold the same voxels with the same channel values. Jobs that ask
// for it (SliceJob::snap_copies) have such copies painted once; halftones stay those of each place.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/types.h"
#include "core/job/grid.h"
#include "core/job/placed_part.h"
#include "core/raster/layer_window.h"

namespace ccslice {

/// The copies that snap_copies() moved.
struct SnappedCopies {
  std::size_t copies = 0;       // Those moved by more than a nanometre.
  Vec3 most_mm = Vec3::Zero();  // The longest way along each axis.
};

/// Moves copies so that those which lie alike are whole voxels and layers from the first of them, by at most half a
/// voxel along each axis. Copies turned and sized nearly alike, so that no corner of the part's box is farther than a
/// tenth of a micrometre from where it is without, lie as the first of them does.
SnappedCopies snap_copies(PlacedParts& parts, const VoxelPitch& pitch);

/// Whole columns and rows of the grid, along x and y.
struct VoxelShift {
  std::int32_t columns = 0, rows = 0;
};

/// Parts of which one is painted. A part that has no such copies is a group of its own.
struct CopyGroup {
  struct Copy {
    std::uint32_t part;
    VoxelShift shift;  // From the painted one to this.
  };
  std::vector<Copy> copies;  // By part: the first one is painted.
  LayerWindow within;        // Columns and rows of the painted one that lie in the grid wherever its copies are.

  bool is_shared() const { return copies.size() > 1; }
};

/// Every part once, by the first of each group. Groups don't depend on the region. Copies share one if they lie alike
/// in the same layers, none is cut off by the sides of the grid, and no source has values of the place.
std::vector<CopyGroup> copy_groups(const PlacedParts& parts);

}  // namespace ccslice
