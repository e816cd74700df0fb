// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer's materials: channels' values of the voxels inside -> mixing fractions -> one material for each.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/field/contone.h"
#include "core/output/plane.h"
#include "core/printing/halftone.h"
#include "core/raster/layer_window.h"
#include "core/raster/occupancy.h"
#include "core/raster/region_runs.h"

namespace ccslice {

/// One thread's worker. Keeps its memory from layer to layer: a byte a voxel.
class HalftonePass {
 public:
  struct Place {
    LayerLattice lattice;
    std::uint32_t layer;
    double z_mm;
    LayerWindow window;   // What the channels' planes and the picture hold,
    LayerWindow counted;  // The histogram and the misfits count these voxels.
  };

  /// `voxels`: of the largest window; there is room for them from the start. REQUIRES: plan outlives the pass.
  explicit HalftonePass(const HalftonePlan& plan, std::size_t voxels = 0);

  /// `spans`: voxels inside, as rasterize() yields them. `channels`: planes of kFloat32 of the window, of
  /// channels_of(plan.printing()) in that order. Error diffusion REQUIRES a window of all that is inside, from the
  /// first row on. Throws Error{kCancelled}, and of strict maps Error{kFractionsOutOfRange}.
  void run(const Place& place, std::span<const VoxelRun> spans, std::span<const ContonePlane> channels,
           const CancellationToken& cancel);
  /// Each voxel by its cell region's map. `runs`: as find_regions() yields them.
  void run(const Place& place, std::span<const RegionRun> runs, std::span<const ContonePlane> channels,
           const CancellationToken& cancel);

  /// The layer that was run last.
  IndexImage image() const noexcept { return {window_.columns, window_.rows, indices_, palette_}; }
  /// Voxels of material 1, 2, ...
  const std::vector<std::uint64_t>& histogram() const noexcept { return histogram_; }
  /// Voxels whose values their maps don't take as they are.
  const MapMisfits& misfits() const noexcept { return misfits_; }

 private:
  /// Voxels that are mixed by one of the plan's mixtures.
  struct MixedRun : VoxelRun {
    std::size_t mixture;
  };
  /// A map of the printing.
  struct Source {
    const Mixture& mixture;
    bool strict;
    std::string field;                // The map's name in messages.
    std::vector<std::size_t> planes;  // Of the mixture's channels, among those of all maps.
  };

  template <typename Run, typename MixtureOf>
  void run_all(const Place& place, std::span<const Run> runs, std::span<const ContonePlane> channels,
               const CancellationToken& cancel, const MixtureOf& mixture_of);
  void run_row(const Place& place, std::span<const MixedRun> row, std::span<const ContonePlane> channels);
  void run_block(const Place& place, const MixedRun& run, std::uint32_t block, std::span<const ContonePlane> channels);
  void count(const Place& place, std::span<const MixedRun> row);
  void count_misfits(const Place& place, const Source& source, const VoxelRun& voxels);
  [[noreturn]] void refuse(const Place& place, const Source& source, std::uint32_t x, std::uint32_t y,
                           std::size_t voxel) const;

  const HalftonePlan& plan_;
  Halftoner halftoner_;
  std::vector<std::uint32_t> palette_;
  LayerWindow window_;
  std::vector<std::uint8_t> indices_;
  std::vector<Source> sources_;  // By mixture.
  std::vector<MixedRun> row_;    // What the window holds of the row at hand.
  std::vector<std::uint64_t> histogram_;
  MapMisfits misfits_;
  std::vector<MixRow> values_;  // Values of the block at hand, by channel.
  Fractions fractions_{};
};

}  // namespace ccslice
