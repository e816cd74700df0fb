// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pieces of cells (slicer/cell_fitter.h) that meet a slab, and their voxels there.
//
// Cells of few voxels are left out: holes, too. What a slab gets depends on the solid, the grid and the slab alone, not
// on what the store held before.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/box_tree.h"
#include "core/limit/limit_solid.h"
#include "core/raster/block_raster.h"
#include "core/raster/occupancy.h"
#include "core/slicer/cell_fitter.h"
#include "core/slicer/interpolation_spec.h"
#include "core/slicer/piece_store.h"

namespace ccslice {

/// Voxels [begin, end) of a row whose centres are in a piece.
struct PieceRun {
  std::uint32_t row, begin, end, piece;
};

/// Of a piece, what painting reads.
struct SlabPiece {
  TileFrame frame;
  std::uint32_t reach;
  bool has_beyond;
};

/// One thread.
class CellPieces {
 public:
  /// `store`: of workers on the same solid and spec only. `rows`: those where pieces and holes have to be complete.
  /// REQUIRES: all tolerances positive.
  CellPieces(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec, std::shared_ptr<PieceStore> store,
             const RowRange& rows = {});

  /// Throws Error{kCancelled}.
  void build(std::uint32_t first_layer, std::uint32_t end_layer, const CancellationToken& cancel);

  const SlabPiece& piece(std::uint32_t index) const { return pieces_[index]; }
  /// One a channel.
  std::span<const CubicPolynomial> polynomials(std::uint32_t piece) const {
    return std::span(polynomials_).subspan(std::size_t{piece} * channels_.size(), channels_.size());
  }
  std::span<const ChannelTolerance> channels() const { return channels_; }
  /// Of a layer of the slab, by piece.
  std::span<const PieceRun> runs(std::uint32_t layer) const { return runs_[layer - first_layer_]; }
  /// Some part that was left out may hold the voxel's centre.
  bool is_in_hole(const Vec3& voxel) const { return holes_.any_at(voxel, 0); }
  /// The parameter of a voxel in a hole, about, if the hole is one of few voxels.
  std::optional<CellParam> parameter_in_hole(const Vec3& voxel) const;
  /// The parameter of a voxel in or beside a piece, about.
  CellParam parameter_near(std::uint32_t piece, const Vec3& voxel) const;
  /// The polynomials of two pieces agree at a voxel: if one of them is no farther off than pieces may be, the other one
  /// is within the tolerance.
  bool agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const;
  /// The voxel may lie off the solid, beside a piece whose polynomials can't be followed there.
  bool may_be_beyond(std::uint32_t piece, const Vec3& voxel) const;

 private:
  struct Found {
    std::uint32_t cell;
    std::shared_ptr<const CellPiece> piece;
  };
  struct Hole {
    std::uint32_t cell;
    std::shared_ptr<const ParameterMap> map;  // Or null.
  };

  void collect_cells();
  bool meets_rows(const Box3& cell) const;
  bool is_small(std::uint32_t cell) const;
  Box3 place_of(std::uint32_t cell) const;
  void collect_parts(const CancellationToken& cancel);
  void collect_parts_of(std::uint32_t cell, CellParts& known, const CancellationToken& cancel);
  void add_hole(const Box3& place, std::uint32_t cell, std::shared_ptr<const ParameterMap> map);
  bool meets_slab(const Box3& voxels) const;
  void scan_pieces(const CancellationToken& cancel);

  std::shared_ptr<const LimitSolid> solid_;
  const Grid grid_;
  const RowRange rows_;
  const Placement voxel_of_mesh_, mesh_of_voxel_;
  const std::vector<ChannelTolerance> channels_;
  const std::shared_ptr<PieceStore> store_;
  CellFitter fitter_;

  // Of the slab at hand.
  std::uint32_t first_layer_ = 0, end_layer_ = 0;
  std::vector<Found> found_;                  // Pieces by cell, then as parts come,
  std::vector<SlabPiece> pieces_;             // and what painting reads of them.
  std::vector<CubicPolynomial> polynomials_;  // By piece, then by channel.
  std::vector<std::vector<PieceRun>> runs_;   // By layer.
  std::vector<Hole> hole_cells_;
  BoxTree holes_;

  // Scratch memory.
  std::vector<std::uint32_t> cells_, busy_cells_;
  std::vector<std::uint32_t> parts_;  // To look at, of the cell at hand: the last one next.
  std::vector<Box3> hole_boxes_;
  BlockRaster raster_;
  std::vector<VoxelRun> scanned_;
};

}  // namespace ccslice
