// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Finds the pieces and holes that meet the layers of a slab.
//
// Layers are looked at in groups: a single one at first, since somebody waits for it, then more and more, up to whole
// slabs. All workers on a job begin with the layer that is waited for first. Cells of few voxels are left out
// (interpolation/samples/small_cells.h).

#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "core/base/cancellation.h"
#include "core/interpolation/pieces/block_raster.h"
#include "core/interpolation/pieces/cell_fitter.h"
#include "core/interpolation/pieces/cell_node_store.h"
#include "core/interpolation/pieces/slab_pieces.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_solid.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// One thread.
class PieceFinder {
 public:
  /// `store`: of workers on the same solid and spec only. `rows`: those where pieces and holes have to be complete.
  /// `blocks`: of the solid and the spec, or its own. REQUIRES: all tolerances positive.
  PieceFinder(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
              std::shared_ptr<CellNodeStore> store, const RowRange& rows = {},
              std::shared_ptr<VoxelBlocks> blocks = nullptr);

  /// Finds what meets a layer of the slab, unless that is known. What was found for others stays. REQUIRES: pieces are
  /// of the same solid and spec, and their slab is started. Throws Error{kCancelled}.
  void find(std::uint32_t layer, SlabPieces& pieces, const CancellationToken& cancel);

 private:
  struct Found {
    LimitCellId cell;
    double low, high;  // Layers that the piece's node may meet.
    std::shared_ptr<const CellPiece> piece;
  };
  struct Group {
    std::uint32_t first_layer = 0, end_layer = 0;
    std::vector<Found> pieces;
    std::vector<SlabPieces::Hole> holes;
    std::vector<Box3> hole_boxes;
  };

  void help_with(std::uint32_t layer, const SmallCells& small, const CancellationToken& cancel);
  void collect_cells(const SmallCells& small);
  bool meets_rows(const Box3& cell) const;
  Box3 bounds_of(LimitCellId cell) const;
  void collect_nodes(const CancellationToken& cancel);
  void collect_nodes_of(LimitCellId cell, CellNodes& known, std::unique_lock<std::mutex>& lock,
                        const CancellationToken& cancel);
  bool meets_group(const Box3& voxels) const;
  void scan_pieces(SlabPieces& pieces, const CancellationToken& cancel);

  std::shared_ptr<const LimitSolid> solid_;
  Grid grid_;
  RowRange rows_;
  Placement voxel_of_mesh_, mesh_of_voxel_;
  std::shared_ptr<CellNodeStore> store_;
  CellFitter fitter_;
  std::uint32_t layers_together_ = 1;
  bool has_begun_ = false;

  // Scratch memory.
  Group group_;  // At hand.
  std::vector<LimitCellId> cells_, busy_cells_;
  std::vector<std::uint32_t> nodes_;  // To look at, of the cell at hand: the last one next.
  BlockRaster raster_;
  std::vector<BlockRun> scanned_;
};

}  // namespace ccslice
