// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which piece of a cell paints which voxel of a layer.
//
// Pieces' runs (interpolation/slab_pieces.h) nearly tile the voxels inside the contours. Where two meet or miss each
// other by a few voxels, because their triangles differ, either may paint these if both would paint them alike; where a
// piece ends at the end of a run of voxels, as a bulging boundary has it, it may paint a few beyond. Nothing is
// extended into a hole, whose material may be another, and what may lie off the solid where that matters is left. What
// then stays unpainted is the rest.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/field/material_pass.h"
#include "core/interpolation/slab_pieces.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// Of one layer. Memory is kept.
class PieceCover {
 public:
  /// `spans`: the voxels inside, as rasterize() yields them. `rows`: of the grid.
  void resolve(const SlabPieces& pieces, std::uint32_t layer, std::uint32_t rows, std::span<const VoxelRun> spans);

  /// Has all voxels of the rows inverted. `spans`: as resolve() had them.
  void invert(const RowRange& rows, std::span<const VoxelRun> spans);

  /// By row, then by column.
  std::span<const PieceRun> painted() const { return painted_; }
  /// Unpainted, to be inverted: short runs in small holes or beside pieces, and others where there are few of them,
  std::span<const HintedRun> to_invert() const { return alone_; }
  /// and others.
  std::span<const VoxelRun> for_tiles() const { return rest_; }

 private:
  void sort_by_row(std::span<const ScannedRun> runs, std::uint32_t rows);
  void enter_row(std::uint32_t row);
  void resolve_span(const VoxelRun& span);
  std::uint32_t paint_next(const ScannedRun& next, std::uint32_t at, const VoxelRun& span);
  void compare_overlap(const ScannedRun& next, std::uint32_t begin, std::uint32_t end);
  void close_gap(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const ScannedRun* after);
  bool agree(std::uint32_t a, std::uint32_t b, std::uint32_t begin, std::uint32_t end) const;
  bool is_sure(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const ScannedRun* after) const;
  const PieceRun* painted_before(std::uint32_t column) const;
  double beyond_painted(std::uint32_t column) const;
  void paint(const PieceRun& run, float after);
  void paint_all(const PieceRun& run, float after);
  void leave(std::uint32_t begin, std::uint32_t end, std::uint32_t beside);
  void sort_out_rest();
  std::optional<CellParam> hint_of_rest(std::size_t run) const;
  bool is_short(std::size_t run) const;
  bool is_in_large_hole(std::size_t run) const;
  Vec3 voxel(std::uint32_t column) const { return Vec3(column, row_, layer_); }

  const SlabPieces* pieces_ = nullptr;
  std::uint32_t layer_ = 0, row_ = 0;
  std::vector<PieceRun> painted_;
  std::vector<PieceRun> overlapped_;  // Scratch memory.
  float after_ = 0;                   // The last one's, as ScannedRun's.
  std::vector<HintedRun> alone_;
  std::vector<VoxelRun> rest_;
  std::vector<std::uint32_t> beside_rest_;  // The piece beside each of them, or none.
  std::vector<std::optional<CellParam>> hints_;
  std::vector<ScannedRun> by_row_;        // By row, then by piece.
  std::vector<std::size_t> row_begins_;   // In by_row_, and one more.
  std::vector<std::uint64_t> by_column_;  // Those of the row at hand: column << 32 | place in the row.
  std::vector<ScannedRun> found_;         // The same, themselves,
  std::size_t first_found_ = 0;           // those before aren't needed any more.
};

}  // namespace ccslice
