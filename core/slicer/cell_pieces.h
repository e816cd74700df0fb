// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pieces of cells (slicer/cell_fitter.h) that meet a slab, and their voxels there.
//
// They are found for some layers of the slab at a time, a window: one at first, since somebody waits for it, then more
// and more. Cells of few voxels are left out: holes, too. What a layer gets depends on the
// solid, the grid and the layer alone, not on what the store held before or on what was found together.

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

/// Voxels [begin, end) of a row, of one piece.
struct PieceRun {
  std::uint32_t row, begin, end, piece;
};

/// Those whose centres are in the piece.
struct ScannedRun : PieceRun {
  float before, after;  // BlockRun's.
};

/// Of a piece, what painting reads.
struct alignas(64) SlabPiece {
  TileFrame frame;
  float error;                 // CellPiece's,
  float reach;                 // and reach.
  std::uint32_t first_beyond;  // Of the slab's polynomials that tell what is beyond the boundary,
  std::uint16_t beyond_count;  // so many.
  bool at_boundary;            // CellPiece's.
  bool has_beyond() const { return beyond_count > 0; }
};

/// One thread.
class CellPieces {
 public:
  /// `store`: of workers on the same solid and spec only. `rows`: those where pieces and holes have to be complete.
  /// REQUIRES: all tolerances positive.
  CellPieces(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec, std::shared_ptr<PieceStore> store,
             const RowRange& rows = {});

  /// Starts on the slab of layers [first_layer, end_layer).
  void start(std::uint32_t first_layer, std::uint32_t end_layer);
  /// Finds what meets a layer of the slab, unless that is known. What was found for others stays. Throws
  /// Error{kCancelled}.
  void find(std::uint32_t layer, const CancellationToken& cancel);

  const SlabPiece& piece(std::uint32_t index) const { return pieces_[index]; }
  /// One a channel.
  std::span<const CubicPolynomial> polynomials(std::uint32_t piece) const {
    return std::span(polynomials_).subspan(std::size_t{piece} * channels_.size(), channels_.size());
  }
  std::span<const ChannelTolerance> channels() const { return channels_; }

  // Of layers, or voxels of layers, that find() was called for:

  /// By piece.
  std::span<const ScannedRun> runs(std::uint32_t layer) const { return runs_[layer - first_layer_]; }
  /// Some part that was left out may hold the voxel's centre.
  bool is_in_hole(const Vec3& voxel) const;
  /// Some small cell, or large part that was left out, may hold it.
  bool is_in_large_hole(const Vec3& voxel) const;
  /// The parameter of a voxel in a hole, about, if all holes there are parts of few voxels.
  std::optional<CellParam> parameter_in_hole(const Vec3& voxel) const;
  /// The parameter of a voxel in or beside a piece, about.
  CellParam parameter_near(std::uint32_t piece, const Vec3& voxel) const;
  /// The polynomials of two pieces agree at a voxel: if one of them is no farther off than pieces may be, the other one
  /// is within the tolerance.
  bool agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const;
  /// The voxel may lie off the solid, beside a piece whose polynomials can't be followed there.
  bool may_be_beyond(std::uint32_t piece, const Vec3& voxel) const;
  /// None of the voxels of a row may, from one to another.
  bool none_is_beyond(std::uint32_t piece, const Vec3& first, const Vec3& last) const;

 private:
  struct Found {
    std::uint32_t cell = 0;
    double low = 0, high = 0;  // Its place's layers.
    std::shared_ptr<const CellPiece> piece;
  };
  struct Hole {
    std::uint32_t cell;
    std::shared_ptr<const ParameterMap> map;  // Or null.
  };
  /// Layers that are looked at together.
  struct Window {
    std::uint32_t first_layer = 0, end_layer = 0;
    std::vector<Hole> holes;
    BoxTree hole_boxes;
    std::size_t end_piece = 0;
  };

  std::span<const CubicPolynomial> beyonds(const SlabPiece& piece) const {
    return std::span(beyonds_).subspan(piece.first_beyond, piece.beyond_count);
  }
  const Window& window_of(const Vec3& voxel) const;
  void start_window(std::uint32_t first_layer);
  void collect_cells();
  bool meets_rows(const Box3& cell) const;
  bool is_small(std::uint32_t cell) const;
  bool is_in_small_cell(const Vec3& voxel) const;
  Box3 place_of(std::uint32_t cell) const;
  void collect_parts(const CancellationToken& cancel);
  void collect_parts_of(std::uint32_t cell, CellParts& known, const CancellationToken& cancel);
  bool meets_window(const Box3& voxels) const;
  void scan_pieces(const CancellationToken& cancel);

  std::shared_ptr<const LimitSolid> solid_;
  const Grid grid_;
  const RowRange rows_;
  const Placement voxel_of_mesh_, mesh_of_voxel_;
  const double smallest_regular_mm3_, smallest_irregular_mm3_;  // Smaller cells are small.
  const bool some_are_small_, all_are_small_;
  const double voxel_in_mesh_mm_;  // At most.
  const std::vector<ChannelTolerance> channels_;
  const std::shared_ptr<PieceStore> store_;
  CellFitter fitter_;
  std::uint32_t layers_together_ = 1;

  // Of the slab at hand.
  std::uint32_t first_layer_ = 0, end_layer_ = 0;
  std::vector<Window> windows_;
  std::vector<std::size_t> window_of_layer_;   // Or kNoWindow.
  std::vector<Found> found_;                   // Pieces by window, then by cell, then as parts come,
  std::vector<SlabPiece> pieces_;              // and what painting reads of them.
  std::vector<CubicPolynomial> polynomials_;   // By piece, then by channel.
  std::vector<CubicPolynomial> beyonds_;       // By piece.
  std::vector<std::vector<ScannedRun>> runs_;  // By layer.

  // Scratch memory.
  Window window_;  // At hand.
  std::vector<std::uint32_t> cells_, busy_cells_;
  std::vector<std::uint32_t> parts_;  // To look at, of the cell at hand: the last one next.
  std::vector<Box3> hole_boxes_;
  BlockRaster raster_;
  std::vector<BlockRun> scanned_;
};

}  // namespace ccslice
