// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of a slab by interpolation with a bounded error.
//
// Cells are painted by polynomials that are fitted to forward samples (interpolation/pieces/slab_pieces.h,
// interpolation/pieces/piece_cover.h). The rest, in small cells, near folds and where no polynomial fits, is cut into
// tiles of voxels (interpolation/tiles/tile_tree.h), whose polynomials are fitted to all cells there, or whose every
// voxel is inverted.
//
// Some of the voxels are inverted and compared (interpolation/paint_guard.h).
//
// All follows from the slab's absolute layers: same bytes for any split.

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "core/field/layer_target.h"
#include "core/field/material_field.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_solid.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

class CellNodeStore;

/// One thread.
class SlabMaterials {
 public:
  /// `store`: shared by workers on the same job only (interpolation/pieces/cell_node_store.h). DEFAULT: one of its own.
  /// `rows`: those that will be painted, from a multiple of kRowsTogether to another or to the grid's end. REQUIRES:
  /// field outlives this and is of the same solid, placement and outside_mm; all tolerances positive.
  SlabMaterials(std::shared_ptr<const LimitSolid> solid, MaterialField& field, const InterpolationSpec& spec,
                std::shared_ptr<CellNodeStore> store = nullptr, const RowRange& rows = {});
  ~SlabMaterials();
  SlabMaterials(SlabMaterials&&) noexcept;
  SlabMaterials& operator=(SlabMaterials&&) noexcept;

  /// The spans of a layer of the slab, as rasterize() yields them for the rows. They stay where they are.
  using SpansOfLayer = std::function<std::span<const VoxelRun>(std::uint32_t layer)>;

  /// Starts on the slab of layers [first_layer, end_layer).
  void start(std::uint32_t first_layer, std::uint32_t end_layer);

  /// Sets the samples of those voxels of one layer of the slab that the target's planes hold, and counts. Asks for its
  /// spans, and for those of all layers of the slab if tiles are needed: a first layer needn't wait for the others
  /// otherwise. kNeedsWholeLayer as in field/material_pass.h. Throws Error{kCancelled},
  /// Error{kInternal} if even the last resort finds nothing, and what spans_of throws.
  WindowOutcome paint(const LayerTarget& target, std::uint32_t layer, const SpansOfLayer& spans_of);

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
