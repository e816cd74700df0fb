// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pieces of cells (interpolation/pieces/cell_fitter.h) that meet a slab, their voxels there, and the holes between
// them: boxes of voxels that no polynomial fits.
//
// They are found for some layers of the slab at a time (interpolation/pieces/piece_finder.h), a GROUP of layers, whose
// holes are kept together. What a layer gets depends on the solid, the grid and the layer alone, not on what was found
// together.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/interpolation/pieces/block_raster.h"
#include "core/interpolation/pieces/cell_fitter.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/samples/small_cells.h"
#include "core/limit/box_tree.h"
#include "core/limit/limit_solid.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// Voxels of one piece.
struct PieceRun : VoxelRun {
  std::uint32_t piece;
};

/// A run of voxels whose centres are in the piece.
struct ScannedRun : PieceRun {
  float before, after;  // BlockRun::before, BlockRun::after.
};

/// What painting reads of a piece.
struct alignas(64) SlabPiece {
  VoxelFrame frame;
  float error;                 // CellPiece::error.
  float reach;                 // CellPiece::reach.
  std::uint32_t first_beyond;  // Index of the first polynomial that tells what is beyond the boundary.
  std::uint16_t beyond_count;  // Number of such polynomials.
  bool at_boundary;            // CellPiece::at_boundary.
  bool has_beyond() const { return beyond_count > 0; }
};

/// A value: found layer by layer, then only read. Memory is kept from slab to slab.
class SlabPieces {
 public:
  /// `tiles_fit`: do_tiles_fit() of the solid and the spec.
  SlabPieces(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec, bool tiles_fit);

  const SlabPiece& piece(std::uint32_t index) const { return pieces_[index]; }
  /// One a channel.
  std::span<const CubicPolynomial> polynomials(std::uint32_t piece) const {
    return std::span(polynomials_).subspan(std::size_t{piece} * channels_.size(), channels_.size());
  }
  std::span<const ChannelTolerance> channels() const { return channels_; }
  const SmallCells& small_cells() const { return small_cells_; }

  // About layers that were found, and their voxels:

  /// The layer's runs, by piece.
  std::span<const ScannedRun> runs(std::uint32_t layer) const { return runs_[layer - first_layer_]; }
  /// Some box that was left out may hold the voxel's centre.
  bool is_in_hole(const Vec3& voxel) const;
  /// Some small cell, or hole without a map, may hold it.
  bool is_for_tiles(const Vec3& voxel) const;
  /// About the parameter of a voxel in a hole, unless it is for tiles.
  [[nodiscard]] std::optional<CellParam> parameter_in_hole(const Vec3& voxel) const;
  /// About the parameter of a voxel in or beside a piece.
  CellParam parameter_near(std::uint32_t piece, const Vec3& voxel) const;
  /// The polynomials of two pieces agree at a voxel: if one of them is no farther off than pieces may be, the other one
  /// is within the tolerance.
  bool agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const;
  /// The voxel may lie off the solid, beside a piece whose polynomials can't be followed there.
  bool may_be_beyond(std::uint32_t piece, const Vec3& voxel) const;

  /// The same of the voxels of one row.
  class Row {
   public:
    /// `voxel`: any of the row's. REQUIRES: pieces outlive this.
    Row(const SlabPieces& pieces, std::uint32_t piece, const Vec3& voxel);
    /// None of the voxels from one to another may be beyond, perhaps but for rounding.
    bool none_is_beyond(const Vec3& first, const Vec3& last) const { return is_below(0, first, last); }
    /// may_be_beyond() is false at all voxels from one to another. It may be where this doesn't say so.
    bool surely_none_is_beyond(const Vec3& first, const Vec3& last) const { return is_below(1, first, last); }
    bool may_be_beyond(const Vec3& voxel) const;

   private:
    static constexpr std::size_t kMostSides = 6;

    bool is_below(double roundings, const Vec3& first, const Vec3& last) const;

    const SlabPieces* pieces_;
    std::uint32_t piece_;
    std::size_t sides_ = 0;
    std::array<std::array<double, 4>, kMostSides> along_;  // A cubic of the frame's x for each side.
    std::array<double, kMostSides> rounding_;              // More than it may be off.
  };

  // For the finder:

  struct Hole {
    LimitCellId cell;
    std::shared_ptr<const ParameterMap> map;  // CellNode::map. Holes without one are left to tiles.
  };

  /// Forgets all: the slab of layers [first_layer, end_layer), none of them found.
  void start(std::uint32_t first_layer, std::uint32_t end_layer);
  bool is_found(std::uint32_t layer) const { return group_of_layer_[layer - first_layer_] != kNoGroup; }
  /// Starts a group at a layer that isn't found; returns its end: the slab's, that of `most_layers`, or the next layer
  /// that is found. Forgets pieces of a group that was started and never finished.
  [[nodiscard]] std::uint32_t start_group(std::uint32_t first_layer, std::uint32_t most_layers);
  /// `runs`: of layers of the group.
  void add_piece(LimitCellId cell, std::shared_ptr<const CellPiece> piece, std::span<const BlockRun> runs);
  /// Its layers are found. `hole_boxes`: in voxels, of the holes, in their order. Throws Error{kCancelled}.
  void finish_group(std::uint32_t first_layer, std::uint32_t end_layer, std::vector<Hole> holes,
                    std::span<const Box3> hole_boxes, const CancellationToken& cancel);

 private:
  static constexpr std::size_t kNoGroup = static_cast<std::size_t>(-1);

  struct Source {
    LimitCellId cell;
    std::shared_ptr<const CellPiece> piece;
  };
  struct Group {
    std::vector<Hole> holes;
    BoxTree hole_boxes;
    std::size_t end_piece;
  };

  std::span<const CubicPolynomial> beyonds(const SlabPiece& piece) const {
    return std::span(beyonds_).subspan(piece.first_beyond, piece.beyond_count);
  }
  const Group& group_of(const Vec3& voxel) const {
    return groups_[group_of_layer_[static_cast<std::uint32_t>(voxel.z()) - first_layer_]];
  }

  std::vector<ChannelTolerance> channels_;
  SmallCells small_cells_;
  std::uint32_t first_layer_ = 0, end_layer_ = 0;
  std::vector<Group> groups_;
  std::vector<std::size_t> group_of_layer_;    // Or kNoGroup.
  std::vector<Source> sources_;                // Where pieces come from; by group, then by cell.
  std::vector<SlabPiece> pieces_;              // What painting reads of the pieces.
  std::vector<CubicPolynomial> polynomials_;   // By piece, then by channel.
  std::vector<CubicPolynomial> beyonds_;       // By piece.
  std::vector<double> beyond_roundings_;       // Of each of them: more than evaluating it is off by.
  std::vector<std::vector<ScannedRun>> runs_;  // By layer.
};

}  // namespace ccslice
