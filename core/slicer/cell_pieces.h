// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cells that meet a slab, cut into pieces over each of which a cubic polynomial of the voxel stands for a channel.
//
// A cell is sampled forward (limit/cell_block.h): positions and channels at 5 x 5 x 5 parameters, no inversion. A cubic
// of the position is fitted to every other sample and judged at all of them (material/block_fitter.h). If the error is
// above its share of the tolerance, or the faces bulge too much to be told from flat triangles, the cell is halved
// along the axes that gain most, and so on. The map from parameters to points is smooth even where its inverse isn't,
// beside irregular lines, and pieces end where cells do; so they are far larger than boxes of voxels would be.
//
// Parts that would get smaller than some hundred voxels, small cells, and all that lies near folds and overlaps are
// left out: holes. Pieces depend on the solid, the grid and the slab alone.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/block_nodes.h"
#include "core/base/cancellation.h"
#include "core/limit/box_tree.h"
#include "core/limit/cell_block.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/material/block_fitter.h"
#include "core/material/tile_polynomial.h"
#include "core/raster/block_raster.h"
#include "core/raster/block_shape.h"
#include "core/slicer/channel_tolerance.h"
#include "core/slicer/grid.h"

namespace ccslice {

struct CellPiece {
  TileFrame frame;
  std::size_t first_polynomial = 0;  // One a channel.
  std::uint32_t reach = 0;           // Columns that the polynomials may be followed beyond the piece.
};

/// Voxels [begin, end) of a row whose centres are in a piece.
struct PieceRun {
  std::uint32_t row, begin, end, piece;
};

/// One thread.
class CellPieces {
 public:
  /// REQUIRES: placement passes validate_placement(); channels not empty, all tolerances positive.
  CellPieces(std::shared_ptr<const LimitSolid> solid, const Placement& placement, const Grid& grid,
             std::vector<ChannelTolerance> channels);

  /// Throws Error{kCancelled}.
  void build(std::uint32_t first_layer, std::uint32_t end_layer, const CancellationToken& cancel);

  const CellPiece& piece(std::uint32_t index) const { return pieces_[index]; }
  /// One a channel.
  std::span<const CubicPolynomial> polynomials(std::uint32_t piece) const {
    return std::span(polynomials_).subspan(pieces_[piece].first_polynomial, channels_.size());
  }
  std::span<const ChannelTolerance> channels() const { return channels_; }
  /// Of a layer of the slab, by piece.
  std::span<const PieceRun> runs(std::uint32_t layer) const { return runs_[layer - first_layer_]; }
  /// Some part that was left out may hold the voxel's centre.
  bool is_in_hole(const Vec3& voxel) const { return holes_.any_at(voxel, 0); }
  /// The polynomials of two pieces agree at a voxel within what each of them may be off.
  bool agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const;

 private:
  void collect_cells();
  bool is_small(std::uint32_t cell) const;
  void add(std::uint32_t cell, const ParamBox& box, const CancellationToken& cancel);
  void sample(std::uint32_t cell, const ParamBox& box);
  bool meets_slab(const Box3& voxels) const;
  unsigned fit_or_split(const BlockShape& shape);
  unsigned axes_to_halve(const BlockShape& shape, bool fits, double error) const;
  double fit(const TileFrame& frame);
  void add_piece(const BlockShape& shape, const TileFrame& frame, std::size_t first_polynomial);

  std::shared_ptr<const LimitSolid> solid_;
  const Grid grid_;
  const Placement voxel_of_mesh_, mesh_of_voxel_;
  const std::vector<ChannelTolerance> channels_;
  LimitEvaluator evaluator_;
  CellBlockSampler sampler_;

  // Of the slab at hand.
  std::uint32_t first_layer_ = 0, end_layer_ = 0;
  std::vector<CellPiece> pieces_;
  std::vector<CubicPolynomial> polynomials_;
  std::vector<std::vector<PieceRun>> runs_;  // By layer.
  BoxTree holes_;

  // Scratch memory.
  std::vector<std::uint32_t> cells_;
  std::vector<Box3> hole_boxes_;
  CellBlock block_;
  std::array<BlockValues, 3> places_;
  BlockPoints points_;
  BlockFitter fitter_;
  BlockRaster raster_;
  std::vector<VoxelRun> scanned_;
};

}  // namespace ccslice
