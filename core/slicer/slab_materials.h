// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of a slab by interpolation with a bounded error.
//
// Cells are painted by polynomials that are fitted to forward samples (slicer/cell_pieces.h, slicer/painted_rows.h).
// The rest, in small cells, near folds and in parts that no polynomial fits, is cut into tiles of voxels
// (slicer/material_tiles.h), whose polynomials are fitted to all cells there, or whose every voxel is inverted.
//
// Some of the voxels are inverted and compared (slicer/paint_guard.h).
//
// All follows from the slab's absolute layers: same bytes for any split.

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"
#include "core/raster/occupancy.h"
#include "core/slicer/cell_pieces.h"
#include "core/slicer/cubic_painter.h"
#include "core/slicer/grid.h"
#include "core/slicer/interpolation_spec.h"
#include "core/slicer/material_field.h"
#include "core/slicer/material_pass.h"
#include "core/slicer/material_tiles.h"
#include "core/slicer/paint_guard.h"
#include "core/slicer/painted_rows.h"
#include "core/slicer/piece_store.h"

namespace ccslice {

/// One thread.
class SlabMaterials {
 public:
  /// `store`: of workers on the same job only. `rows`: those that will be painted, from a multiple of kRowsTogether to
  /// another or to the grid's end. REQUIRES: field outlives this and is of the same solid, placement and
  /// outside_mm; all tolerances positive.
  SlabMaterials(std::shared_ptr<const LimitSolid> solid, MaterialField& field, const InterpolationSpec& spec,
                std::shared_ptr<PieceStore> store = make_piece_store(), const RowRange& rows = {});

  /// The spans of a layer of the slab, as rasterize() yields them for the rows. They stay where they are.
  using SpansOfLayer = std::function<std::span<const Span>(std::uint32_t layer)>;

  /// Starts on the slab of layers [first_layer, end_layer).
  void start(std::uint32_t first_layer, std::uint32_t end_layer);

  /// Sets the samples of those voxels of one layer of the slab that the target's planes hold, and counts. Asks for its
  /// spans, and for those of all layers of the slab if tiles are needed: a first layer needn't wait for the others
  /// otherwise. False if some voxels need more of the layer than the planes hold. Throws Error{kCancelled},
  /// Error{kInternal} if even the last resort finds nothing, and what spans_of throws.
  bool paint(const LayerTarget& target, std::uint32_t layer, const SpansOfLayer& spans_of);

 private:
  struct Layer {
    bool resolved = false, guarded = false;
    PaintedRows rows;
    std::vector<RowRange> repainted;  // That the guard has inverted.
  };

  const PaintedRows& rows_of(std::uint32_t layer, const SpansOfLayer& spans_of, const CancellationToken& cancel);
  void guard(std::uint32_t layer, std::span<const Span> spans, const CancellationToken& cancel);
  bool agrees(std::uint32_t layer, const PieceRun& run);
  bool agrees(std::uint32_t layer, const Span& run);
  void solve_tiles(const SpansOfLayer& spans_of, const CancellationToken& cancel);
  void paint_pieces(const LayerTarget& target, std::uint32_t layer, std::span<const PieceRun> runs);

  const Grid grid_;
  PaintGuard guard_;
  CellPieces pieces_;
  MaterialTiles tiles_;  // Of the rest.
  std::uint32_t first_layer_ = 0;
  std::vector<Layer> layers_;
  bool tiles_solved_ = false;
  LayerCubics cubics_;  // Of the pieces.
};

}  // namespace ccslice
