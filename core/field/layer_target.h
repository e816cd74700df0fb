// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a material pass fills: the planes of one layer, and its counts. Regions work on more voxels than they deliver,
// so what the planes hold and what is counted differ.

#pragma once

#include <cstdint>
#include <span>

#include "core/base/cancellation.h"
#include "core/field/contone.h"
#include "core/job/slice_job.h"
#include "core/raster/layer_window.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// A layer to fill. The references must outlive it.
struct LayerTarget {
  LayerLattice lattice;
  double z_mm;
  std::span<ContonePlane> planes;
  LayerStats& stats;
  const CancellationToken& cancel;
  LayerWindow window;    // What the planes hold. Voxels elsewhere are left out,
  LayerWindow counted;   // Only voxels in here are counted.
  bool is_whole = true;  // The window holds all voxels inside of the layer.

  std::uint64_t count(const VoxelRun& span) const {
    const VoxelRun part = counted.clipped(span);
    return part.end - part.begin;
  }
};

/// Whether all voxels that a window of a layer holds have their samples.
enum class [[nodiscard]] WindowOutcome : std::uint8_t{
    kComplete,         // All have their samples.
    kNeedsWholeLayer,  // Some take theirs from voxels that may be anywhere in the layer. They have none.
};

}  // namespace ccslice
