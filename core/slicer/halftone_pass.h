// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer's materials: channels' values of the voxels inside -> mixing fractions -> one material for each.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/field/contone.h"
#include "core/output/plane.h"
#include "core/printing/halftone.h"
#include "core/raster/layer_window.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// One thread's worker. Keeps its memory from layer to layer: a byte a voxel.
class HalftonePass {
 public:
  struct Place {
    LayerLattice lattice;
    std::uint32_t layer;
    double z_mm;
    LayerWindow window;   // What the channels' planes and the picture hold,
    LayerWindow counted;  // The histogram counts these voxels.
  };

  /// REQUIRES: plan outlives the pass.
  explicit HalftonePass(const HalftonePlan& plan);

  /// `spans`: voxels inside, as rasterize() yields them. `channels`: planes of kFloat32 of the window, of
  /// plan.mixture().channels() in that order. Error diffusion REQUIRES a window of all columns, from row 0 on. Throws
  /// Error{kCancelled}, and of strict maps Error{kFractionsOutOfRange}.
  void run(const Place& place, std::span<const VoxelRun> spans, std::span<const ContonePlane> channels,
           const CancellationToken& cancel);

  /// The layer that was run last.
  IndexImage image() const noexcept { return {window_.columns, window_.rows, indices_, palette_}; }
  /// Voxels of material 1, 2, ...
  const std::vector<std::uint64_t>& histogram() const noexcept { return histogram_; }

 private:
  void run_row(const Place& place, std::span<const VoxelRun> row, std::span<const ContonePlane> channels);
  void run_block(const Place& place, const VoxelRun& run, std::uint32_t block, std::span<const ContonePlane> channels);
  void count(const Place& place, std::span<const VoxelRun> row);
  [[noreturn]] void refuse(const Place& place, std::uint32_t x, std::uint32_t y, std::size_t voxel) const;

  const HalftonePlan& plan_;
  Halftoner halftoner_;
  std::vector<std::uint32_t> palette_;
  LayerWindow window_;
  std::vector<std::uint8_t> indices_;
  std::vector<VoxelRun> row_;  // What the window holds of the row at hand.
  std::vector<std::uint64_t> histogram_;
  std::vector<MixRow> values_;  // Values of the block at hand, by channel.
  Fractions fractions_{};
};

}  // namespace ccslice
