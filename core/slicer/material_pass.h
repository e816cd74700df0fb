// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A material for every voxel inside the contours of one layer.
//
// Rows from 0 up, voxels from left to right. The hint of a voxel (coherence, [Luu19, 3.2.2]) is the parameter of its
// left neighbour in the span; failing that, the nearest solved one in the row below, at most 16 columns away; failing
// that, none. So hints, and with them every last bit of the result, follow from the layer's content alone.
//
// Voxels where inversion finds nothing: unresolved_voxels.h.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/material/contone.h"
#include "core/raster/occupancy.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/material_field.h"
#include "core/slicer/unresolved_voxels.h"

namespace ccslice {

class MaterialPass {
 public:
  /// REQUIRES: field outlives the pass.
  explicit MaterialPass(MaterialField& field) : field_(&field), values_(field.channel_count()) {}

  /// Sets the samples of all voxels of `spans` (as rasterize() yields them) in `planes`, and counts in `stats`.
  /// Throws Error{kCancelled}, and Error{kInternal} if even the last resort finds nothing.
  void run(std::span<const Span> spans, const LayerLattice& lattice, double z_mm, std::span<ContonePlane> planes,
           LayerStats& stats, const CancellationToken& cancel);

 private:
  using Row = std::vector<std::optional<CellParam>>;

  void solve_span(const Span& span);
  void set_samples(const Span& span, std::uint32_t x, const CellParam& at);
  std::optional<CellParam> hint_from_row_below(std::uint32_t x) const;
  void start_row(std::uint32_t y);

  MaterialField* field_;
  std::vector<double> values_;
  Row row_, row_below_;                 // Solved parameters by column.
  std::optional<std::uint32_t> row_y_;  // The row that row_ holds.
  UnresolvedVoxels unresolved_;
  // Of the layer at hand.
  LayerLattice lattice_;
  double z_mm_ = 0;
  std::span<ContonePlane> planes_;
  LayerStats* stats_ = nullptr;
  const CancellationToken* cancel_ = nullptr;
};

}  // namespace ccslice
