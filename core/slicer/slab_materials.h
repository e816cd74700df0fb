// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of a slab by interpolation with a checked error.
//
// Cells are painted by polynomials that are fitted to forward samples (slicer/cell_pieces.h, slicer/painted_rows.h).
// The rest, in small cells, near folds and in parts that no polynomial fits, is cut into tiles of voxels
// (slicer/material_tiles.h), whose polynomials are fitted to inverted voxels, or whose every voxel is inverted.
//
// All follows from the slab's absolute layers: same bytes for any split.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"
#include "core/raster/occupancy.h"
#include "core/slicer/cell_pieces.h"
#include "core/slicer/channel_tolerance.h"
#include "core/slicer/grid.h"
#include "core/slicer/material_field.h"
#include "core/slicer/material_pass.h"
#include "core/slicer/material_tiles.h"
#include "core/slicer/painted_rows.h"

namespace ccslice {

/// One thread.
class SlabMaterials {
 public:
  /// REQUIRES: field outlives this and is of the same solid and placement; channels not empty, each once, all
  /// tolerances positive.
  SlabMaterials(std::shared_ptr<const LimitSolid> solid, const Placement& placement, MaterialField& field,
                const Grid& grid, const std::vector<ChannelTolerance>& channels);

  /// Fits the slab of layers [first_layer, first_layer + layers.size()), whose spans rasterize() yielded.
  /// Throws Error{kCancelled}.
  void solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers, const CancellationToken& cancel);

  /// Sets the samples of all voxels of one layer of the slab, and counts. `spans`: those that solve() saw.
  /// Throws Error{kCancelled}, and Error{kInternal} if even the last resort finds nothing.
  void paint(const LayerTarget& target, std::uint32_t layer, std::span<const Span> spans);

 private:
  void paint_pieces(const LayerTarget& target, std::uint32_t layer, std::span<const PieceRun> runs) const;

  const Grid grid_;
  CellPieces pieces_;
  MaterialTiles tiles_;  // Of the rest.
  std::uint32_t first_layer_ = 0;
  std::vector<PaintedRows> rows_;  // By layer.
};

}  // namespace ccslice
