// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Makes the tiles of a slab, for voxels that lie in cells too small for pieces of their own.
//
// In each tile a cubic polynomial is fitted to all cells there, and its error bounded over all of them
// (interpolation/tiles/tile_fitter.h). If it may be too large, the tile is halved along its longest axes, and so on; in
// the smallest tiles, where there are few voxels a cell, and where the solid folds, every voxel is inverted.
//
// The tiles follow from the solid and the slab's voxels alone, which follow from its absolute layers: same bytes for
// any split of a job. Those of a row of tiles follow from its own voxels alone.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/field/material_field.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/tiles/tile_fitter.h"
#include "core/interpolation/tiles/tile_tree.h"
#include "core/interpolation/tiles/tile_trials.h"

namespace ccslice {

/// One thread.
class TileTreeBuilder {
 public:
  /// `promising`: tiles are likely to fit (do_tiles_fit()). `blocks`: of the solid and the spec, or its own.
  /// REQUIRES: field outlives this and is of the solid and of the spec's placement and outside_mm; all tolerances
  /// positive.
  TileTreeBuilder(std::shared_ptr<const LimitSolid> solid, const MaterialField& field, const InterpolationSpec& spec,
                  bool promising, std::shared_ptr<VoxelBlocks> blocks = nullptr);

  /// Makes the tree of the slab of layers [first_layer, first_layer + layers.size()), for these runs of each, by row,
  /// then by column. REQUIRES: the tree is of the spec's grid and channels. Throws Error{kCancelled}.
  void build(std::uint32_t first_layer, std::span<const std::span<const VoxelRun>> layers,
             const CancellationToken& cancel, TileTree& tree);

 private:
  using Node = TileTree::Node;
  using VoxelBox = TileTree::VoxelBox;

  struct LayerRun : VoxelRun {
    std::uint32_t layer;
  };

  void bucket_row(std::uint32_t tile_row, std::span<const std::span<const VoxelRun>> layers);
  Node build_node(const VoxelBox& box, std::size_t first_run, const TileParticles::Range& around);
  Node build_split(const VoxelBox& box, std::uint8_t axes, std::size_t first_run, const TileParticles::Range& inside);
  Node build_exact(std::size_t first_run, const TileParticles::Range& inside);
  std::uint8_t axes_to_halve(const VoxelBox& box) const;
  bool is_ambiguous(const Box3& centres) const;

  const MaterialField* field_;
  const Grid grid_;
  const bool promising_;
  TileFitter fitter_;

  // The slab at hand.
  TileTree* tree_ = nullptr;
  CancellationToken cancel_;
  std::uint32_t first_layer_ = 0;
  TileTrials trials_;     // In the tile at hand.
  std::size_t fits_ = 0;  // Nodes that are painted.

  // Scratch memory.
  std::vector<std::size_t> cursors_;            // Next run by layer.
  std::vector<std::vector<LayerRun>> buckets_;  // Runs of one row of tiles, by column.
  std::vector<LayerRun> runs_;                  // Runs of the tile at hand and of the nodes on the way down.
};

}  // namespace ccslice
