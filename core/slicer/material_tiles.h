// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of the voxels of a slab that lie in cells too small for pieces of their own.
//
// A slab is cut into tiles of voxels at multiples of absolute voxel indices. In each, a cubic polynomial is fitted to
// all cells there, and its error bounded over all of them (slicer/tile_fitter.h). If it may be too large, the tile is
// halved along its longest axes, and so on; in the smallest tiles, where there are few voxels a cell, and where the
// solid folds, every voxel is inverted.
//
// The tiles follow from the solid and the slab's occupancy alone, which follows from its absolute layers: same bytes
// for any split. Those of a row of tiles follow from its own voxels alone.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/raster/occupancy.h"
#include "core/slicer/cubic_painter.h"
#include "core/slicer/grid.h"
#include "core/slicer/interpolation_spec.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/material_field.h"
#include "core/slicer/material_pass.h"
#include "core/slicer/tile_fitter.h"

namespace ccslice {

class MaterialTiles {
 public:
  /// REQUIRES: field outlives the tiles and is of the solid and of the spec's placement and outside_mm; all tolerances
  /// positive.
  MaterialTiles(std::shared_ptr<const LimitSolid> solid, MaterialField& field, const InterpolationSpec& spec);

  /// Fits the slab of layers [first_layer, first_layer + layers.size()), whose spans rasterize() yielded.
  /// Throws Error{kCancelled}.
  void solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers, const CancellationToken& cancel);

  /// Sets the samples of those voxels of one layer of the slab that the target's planes hold, and counts. `spans`:
  /// those that solve() saw; `alone`: others, to be inverted one by one, by row, then by column; `inside`: all that
  /// have samples then, from which those that aren't reached take theirs. False if those need more of the layer than
  /// the planes hold. Throws Error{kCancelled}, and Error{kInternal} if even the last resort finds nothing.
  bool paint(const LayerTarget& target, std::uint32_t layer, std::span<const Span> spans,
             std::span<const HintedRun> alone, std::span<const Span> inside);

  /// What paints a voxel of the slab that solve() saw.
  struct Paint {
    TileFrame frame;
    std::span<const CubicPolynomial> polynomials;  // One a channel.
  };
  /// Nothing if it is inverted.
  std::optional<Paint> paint_of(std::uint32_t layer, std::uint32_t row, std::uint32_t column) const;

 private:
  using Voxel = std::array<std::uint32_t, 3>;  // Column, row, layer.

  /// Voxels [low, high).
  struct VoxelBox {
    Voxel low, high;
  };
  struct Run {
    std::uint32_t layer, row, begin, end;
  };
  struct Node {
    enum class Kind : std::uint8_t { kEmpty, kPolynomial, kExact, kSplit };
    Kind kind = Kind::kEmpty;
    std::uint8_t split_axes = 0;  // kSplit: bit a if halved along axis a.
    std::uint32_t index = 0;      // kSplit: first child; kPolynomial, kExact: index of what it holds.
  };
  struct Fit {
    TileFrame frame;
    std::size_t first_polynomial;  // One a channel.
  };
  struct PaintJob;

  std::span<const CubicPolynomial> polynomials_of(const Fit& fit) const {
    return std::span(polynomials_).subspan(fit.first_polynomial, channels_.size());
  }

  /// The part of a split node's box that holds a voxel, and its number among the children.
  std::uint32_t enter_part(const Node& node, const Voxel& voxel, VoxelBox& box) const;
  VoxelBox tile_box(std::uint32_t column, std::uint32_t row) const;
  void bucket_row(std::uint32_t tile_row, std::span<const std::span<const Span>> layers);
  /// From runs_ from this one on, in a box of these particles.
  Node build(const VoxelBox& box, std::size_t first_run, const TileFitter::Particles& around);
  Node build_split(const VoxelBox& box, std::uint8_t axes, std::size_t first_run, const TileFitter::Particles& inside);
  Node add_fit();
  Node add_exact(std::size_t first_run, const TileFitter::Particles& inside);
  std::uint8_t axes_to_halve(const VoxelBox& box) const;
  bool is_ambiguous(const Box3& centres) const;

  void paint_piece(PaintJob& job, const Node& node, const VoxelBox& box, std::uint32_t row, std::uint32_t begin,
                   std::uint32_t end);
  void paint_tiles(PaintJob& job, const Span& span);
  void paint_alone(PaintJob& job, const HintedRun& alone);
  void paint_exactly(PaintJob& job, const std::optional<CellParam>& hint, const Span& run);
  void finish_exact_run(PaintJob& job);

  MaterialField* field_;
  const Grid grid_;
  const std::vector<ChannelTolerance> channels_;
  Voxel tile_size_;
  std::uint32_t tile_columns_, tile_rows_;
  TileFitter fitter_;

  // Of the slab at hand.
  CancellationToken cancel_;
  std::uint32_t first_layer_ = 0;
  std::vector<Node> tiles_;  // By row, then by column.
  std::vector<Node> children_;
  std::vector<Fit> fits_;
  std::vector<CubicPolynomial> polynomials_;
  LayerCubics cubics_;                           // Of the fits.
  std::vector<std::optional<CellParam>> hints_;  // Of exact tiles.

  // Scratch memory.
  std::vector<std::size_t> cursors_;       // Next span by layer.
  std::vector<std::vector<Run>> buckets_;  // Of one row of tiles, by column.
  std::vector<Run> runs_;                  // Of the tile at hand and of the nodes on the way down.
  MaterialPass exact_;
};

}  // namespace ccslice
