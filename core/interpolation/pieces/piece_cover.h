// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which piece of a cell paints which voxel of a layer: the COVER.
//
// Runs of pieces (interpolation/pieces/slab_pieces.h) nearly tile the voxels inside the contours. They overlap or miss
// each other by a few voxels, because flat triangles stand for curved faces, and neighbours' triangles differ. Let p
// and q be the polynomials of two pieces, whose errors are at most E of the tolerance T where each piece is. At a voxel
// that either may hold, |p - q| <= (1 - E) T says that both are within T there, whichever piece holds it: then one of
// them paints it. Where the contours end before or after the last piece's triangles, as a bulging boundary has it, the
// piece is followed up to its reach: so far its error grows to T at most.
//
// Nothing is extended into a hole, whose material may be another, nor to where a voxel may lie off the solid and
// materials are so steep that this matters. Those voxels stay unpainted: they are inverted one by one, or cut into
// tiles.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/field/material_pass.h"
#include "core/interpolation/pieces/slab_pieces.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// Runs of a layer by row, and then by piece. Memory is kept.
class RunsByRow {
 public:
  /// `runs`: by piece. `rows`: of the grid.
  void sort(std::span<const ScannedRun> runs, std::uint32_t rows);
  std::span<const ScannedRun> of_row(std::uint32_t row) const {
    return std::span(runs_).subspan(row_begins_[row], row_begins_[row + 1] - row_begins_[row]);
  }

 private:
  std::vector<ScannedRun> runs_;
  std::vector<std::size_t> row_begins_;  // And the end.
};

/// The cover of one layer. Memory is kept.
class PieceCover {
 public:
  /// `spans`: the voxels inside, as rasterize() yields them. `rows`: of the grid. `sorted`: scratch memory, which the
  /// layers of a slab share.
  void resolve(const SlabPieces& pieces, std::uint32_t layer, std::uint32_t rows, std::span<const VoxelRun> spans,
               RunsByRow& sorted);

  /// Has all voxels of the rows inverted. `spans`: as resolve() had them.
  void invert(const RowRange& rows, std::span<const VoxelRun> spans);

  /// Painted runs, by row, then by column.
  std::span<const PieceRun> painted() const { return painted_; }
  /// The piece that paints a voxel, or null.
  const PieceRun* painted_at(std::uint32_t row, std::uint32_t column) const;
  /// Gaps that were closed: runs that no piece holds, and pieces beside them paint, or have left since. By row.
  std::span<const VoxelRun> closed_gaps() const { return closed_gaps_; }
  /// Unpainted runs that are inverted one by one: those in holes that have a map, short ones beside pieces, and others
  /// where there are few of them. By row, then by column, and so are all other runs here.
  std::span<const HintedRun> to_invert() const { return to_invert_; }
  /// All other unpainted runs.
  std::span<const VoxelRun> for_tiles() const { return unpainted_; }

 private:
  void enter_row(std::uint32_t row, const RunsByRow& sorted);
  void resolve_span(const VoxelRun& span);
  std::uint32_t paint_next(const ScannedRun& next, std::uint32_t at, const VoxelRun& span);
  void compare_overlap(const ScannedRun& next, std::uint32_t begin, std::uint32_t end);
  void close_gap(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const ScannedRun* after);
  bool agree(std::uint32_t a, std::uint32_t b, std::uint32_t begin, std::uint32_t end) const;
  bool is_sure(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const ScannedRun* after) const;
  const PieceRun* painted_before(std::uint32_t column) const;
  double beyond_painted(std::uint32_t column) const;
  PieceRun surely_none_beyond(const SlabPieces::Row& row, const PieceRun& run) const;
  void paint(const PieceRun& run, float after);
  void paint_all(const PieceRun& run, float after);
  void leave(std::uint32_t begin, std::uint32_t end, std::uint32_t beside);
  void sort_out_unpainted();
  void find_hint_of(std::size_t run);
  bool needs_no_tile(std::size_t run) const;
  bool is_for_tiles(std::size_t run) const;
  Vec3 voxel(std::uint32_t column) const { return Vec3(column, row_, layer_); }

  const SlabPieces* pieces_ = nullptr;
  std::uint32_t layer_ = 0, row_ = 0;
  std::vector<PieceRun> painted_;
  std::vector<PieceRun> overlapped_;  // Scratch memory.
  float after_ = 0;                   // ScannedRun::after of the last painted run.
  std::vector<VoxelRun> closed_gaps_;
  std::vector<HintedRun> to_invert_;
  std::vector<VoxelRun> unpainted_;
  std::vector<std::uint32_t> beside_unpainted_;  // By unpainted run: the piece beside it, or none.
  std::vector<std::optional<CellParam>> hints_;  // By unpainted run,
  std::vector<bool> in_hole_;                    // and whether a hole's map told it.
  std::vector<std::uint64_t> by_column_;         // Runs of the row at hand: column << 32 | place in the row.
  std::vector<ScannedRun> found_;                // Runs of the row at hand, by column.
  std::size_t first_found_ = 0;                  // Those before aren't needed any more.
};

}  // namespace ccslice
