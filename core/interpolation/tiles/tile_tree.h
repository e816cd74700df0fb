// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The tiles of a slab: boxes of voxels at multiples of absolute voxel indices, each halved along some axes, and so on,
// down to leaves. A leaf is painted by one cubic polynomial a channel, or its every voxel is inverted.
//
// Nodes are kept by index: those of the tiles by row, then by column, and the children of a split node eight together,
// by one bit an axis, of which only those are in use whose axes are halved.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/job/grid.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// A value: built once a slab (interpolation/tiles/tile_tree_builder.h), then only read. Memory is kept from slab to
/// slab.
class TileTree {
 public:
  using Voxel = std::array<std::uint32_t, 3>;  // Column, row, layer.

  /// Voxels [low, high).
  struct VoxelBox {
    Voxel low, high;
  };

  struct Node {
    enum class Kind : std::uint8_t { kEmpty, kPolynomial, kExact, kSplit };
    Kind kind = Kind::kEmpty;
    std::uint8_t split_axes = 0;  // kSplit: bit a if halved along axis a.
    std::uint32_t index = 0;      // kSplit: first child; kPolynomial: for cubics(); kExact: for hint().
  };

  /// What paints the voxels of a leaf.
  struct Cubics {
    VoxelFrame frame;
    std::span<const CubicPolynomial> polynomials;  // One a channel.
  };

  TileTree(const Grid& grid, std::size_t channels);

  std::uint32_t tile_columns() const { return tile_columns_; }
  std::uint32_t tile_rows() const { return tile_rows_; }
  const Voxel& tile_size() const { return tile_size_; }
  VoxelBox tile_box(std::uint32_t tile_column, std::uint32_t tile_row) const;

  Cubics cubics(std::uint32_t index) const {
    const Fit& fit = fits_[index];
    return {fit.frame, std::span(polynomials_).subspan(fit.first_polynomial, channels_)};
  }
  /// A parameter near the voxels of an inverted leaf, if one is known.
  const std::optional<CellParam>& hint(std::uint32_t index) const { return hints_[index]; }
  /// Nothing if the voxel is inverted.
  [[nodiscard]] std::optional<Cubics> cubics_at(const Voxel& voxel) const;

  /// Calls visit(leaf, part) for the leaves that a run of a layer meets, but for empty ones, and what each holds of it,
  /// by column.
  template <typename Visit>
  void visit_leaves(std::uint32_t layer, const VoxelRun& run, const Visit& visit) const {
    const std::uint32_t tile_row = run.row / tile_size_[1];
    for (std::uint32_t column = run.begin / tile_size_[0]; column * tile_size_[0] < run.end; ++column) {
      visit_node(tile(column, tile_row), tile_box(column, tile_row), layer, run, visit);
    }
  }

  // For the builder:

  /// Forgets all: the tree of a slab that starts at this layer.
  void clear(std::uint32_t first_layer);
  void set_tile(std::uint32_t tile_column, std::uint32_t tile_row, const Node& node) {
    tiles_[std::size_t{tile_columns_} * tile_row + tile_column] = node;
  }
  [[nodiscard]] Node add_polynomials(const VoxelFrame& frame, std::span<const CubicPolynomial> polynomials);
  [[nodiscard]] Node add_exact(const std::optional<CellParam>& hint);
  /// Its children are empty until they are set.
  [[nodiscard]] Node add_split(std::uint8_t axes);
  void set_child(const Node& split, std::uint32_t child, const Node& node) { children_[split.index + child] = node; }

 private:
  struct Fit {
    VoxelFrame frame;
    std::size_t first_polynomial;  // One a channel.
  };

  const Node& tile(std::uint32_t tile_column, std::uint32_t tile_row) const {
    return tiles_[std::size_t{tile_columns_} * tile_row + tile_column];
  }
  static std::uint32_t enter_child(const Node& split, const Voxel& voxel, VoxelBox& box);

  template <typename Visit>
  void visit_node(const Node& node, const VoxelBox& box, std::uint32_t layer, const VoxelRun& run,
                  const Visit& visit) const {
    const VoxelRun part{run.row, std::max(run.begin, box.low[0]), std::min(run.end, box.high[0])};
    if (part.begin >= part.end || node.kind == Node::Kind::kEmpty) return;
    if (node.kind != Node::Kind::kSplit) return visit(node, part);
    VoxelBox half = box;
    const std::uint32_t child = enter_child(node, {part.begin, run.row, layer}, half);
    visit_node(children_[node.index + child], half, layer, part, visit);
    if (half.high[0] >= part.end) return;
    half.low[0] = half.high[0];  // The other half of the row.
    half.high[0] = box.high[0];
    visit_node(children_[node.index + (child | 1)], half, layer, part, visit);
  }

  const std::size_t channels_;
  const Voxel tile_size_;
  const std::uint32_t tile_columns_, tile_rows_;
  std::uint32_t first_layer_ = 0;
  std::vector<Node> tiles_;  // By row, then by column.
  std::vector<Node> children_;
  std::vector<Fit> fits_;
  std::vector<CubicPolynomial> polynomials_;
  std::vector<std::optional<CellParam>> hints_;  // Hints of inverted leaves.
};

}  // namespace ccslice
