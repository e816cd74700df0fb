// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Voxels of one layer by exact inversion: all that are inside the contours, or some runs of them.
//
// Runs come by row, from 0 up, and within a row from left to right; each is solved as a row of points
// (row_inverter.h). The hint of a run's first voxel (coherence, [Luu19, 3.2.2]) is the nearest place where the row or
// the row below entered a patch, or a run ended, at most 16 columns away; failing that, the caller's. Rows at
// multiples of 64 have none below. So hints, and with them every last bit of the result, follow from the layer's
// content alone, and that of a row from the rows since the last such multiple.
//
// Voxels where inversion finds nothing: unresolved_voxels.h.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/field/layer_target.h"
#include "core/field/material_field.h"
#include "core/field/unresolved_voxels.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// A run of voxels to invert, and the parameter of its first one, about, if known.
struct HintedRun : VoxelRun {
  std::optional<CellParam> hint;
};

class MaterialPass {
 public:
  /// REQUIRES: field outlives the pass.
  explicit MaterialPass(MaterialField& field) : field_(&field) {}

  void start_layer();
  /// Sets the samples of those of a run's voxels that the target's planes hold, and counts. Throws Error{kCancelled}.
  void solve(const LayerTarget& target, const VoxelRun& run, const std::optional<CellParam>& hint = {});
  /// Does as solve() does, from a hint that, if there is one, is better than what neighbours say.
  void solve_from(const LayerTarget& target, const HintedRun& run);
  /// Gives voxels that weren't reached their samples. `spans`: all voxels inside, as rasterize() yields them.
  /// kNeedsWholeLayer if the planes hold such voxels, but not the whole layer. Throws Error{kCancelled}, and
  /// Error{kInternal} if even the last resort finds nothing.
  WindowOutcome finish_layer(const LayerTarget& target, std::span<const VoxelRun> spans) const;

  /// All voxels of `spans`: start, solve, finish.
  WindowOutcome run(const LayerTarget& target, std::span<const VoxelRun> spans);

 private:
  void start_row(std::uint32_t y);
  void solve_near(const LayerTarget& target, const VoxelRun& run, const std::optional<CellParam>& near);
  void keep(const LayerTarget& target, const VoxelRun& run);
  std::span<const RowEntry> beside(const VoxelRun& run);
  [[nodiscard]] std::optional<CellParam> nearest_entry(std::int64_t column) const;

  MaterialField* field_;
  SolvedRow solved_;
  UnresolvedVoxels unresolved_;
  std::optional<std::uint32_t> row_;     // The row at hand.
  std::vector<RowEntry> entries_;        // Its entries and ends of runs, by column.
  std::vector<RowEntry> entries_below_;  // Entries and ends of runs of the row below.
  std::vector<RowEntry> beside_;         // Those of the row below, numbered from the run's first voxel.
};

}  // namespace ccslice
