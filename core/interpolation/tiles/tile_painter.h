// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Paints the voxels of a slab's tiles, and inverts those that no polynomial paints.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/field/layer_target.h"
#include "core/field/material_field.h"
#include "core/field/material_pass.h"
#include "core/interpolation/fits/cubic_painter.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/tiles/tile_tree.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// One thread.
class TilePainter {
 public:
  /// REQUIRES: field outlives this.
  TilePainter(MaterialField& field, std::span<const ChannelTolerance> channels)
      : channels_(channels.begin(), channels.end()), exact_(field) {}

  /// Forgets the tiles of other slabs.
  void start_slab() { cubics_.clear(); }

  /// Sets the samples of those voxels of one layer that the target's planes hold, and counts. `for_tiles`: runs that
  /// the tree was built for; `to_invert`: others, to be inverted one by one, by row, then by column; `inside`: all
  /// voxels that have samples then, from which those that aren't reached take theirs. kNeedsWholeLayer as in
  /// field/material_pass.h. REQUIRES: the tree is the same since start_slab(). Throws Error{kCancelled}, and
  /// Error{kInternal} if even the last resort finds nothing.
  WindowOutcome paint(const TileTree& tree, const LayerTarget& target, std::uint32_t layer,
                      std::span<const VoxelRun> for_tiles, std::span<const HintedRun> to_invert,
                      std::span<const VoxelRun> inside);

 private:
  void add_exact(const LayerTarget& target, const std::optional<CellParam>& hint, const VoxelRun& run);
  void solve_exact_run(const LayerTarget& target);

  const std::vector<ChannelTolerance> channels_;
  LayerCubics cubics_;  // Cubics of the tree's leaves.
  MaterialPass exact_;
  HintedRun exact_run_{};  // To be inverted, across leaves; empty if begin == end.
};

}  // namespace ccslice
