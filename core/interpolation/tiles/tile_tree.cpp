// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_tree.h"

#include "core/job/slice_job.h"

namespace ccslice {
namespace {

constexpr double kTileMm = 11.2;  // Tiles are at most this long each way, powers of two of voxels,
constexpr std::uint32_t kMostColumns = 4 * kRowsTogether, kMostRows = kRowsTogether;  // and of at most so many.

std::uint32_t tile_voxels(double pitch_mm, std::uint32_t most) {
  std::uint32_t size = 1;
  while (size < most && 2 * size * pitch_mm <= kTileMm) size *= 2;
  return size;
}

std::uint32_t tiles_over(std::uint32_t voxels, std::uint32_t size) { return (voxels + size - 1) / size; }

}  // namespace

TileTree::TileTree(const Grid& grid, std::size_t channels)
    : channels_(channels),
      tile_size_{tile_voxels(grid.pitch.x_mm, kMostColumns), tile_voxels(grid.pitch.y_mm, kMostRows), kSlabLayers},
      tile_columns_(tiles_over(grid.extent.columns, tile_size_[0])),
      tile_rows_(tiles_over(grid.extent.rows, tile_size_[1])) {}

TileTree::VoxelBox TileTree::tile_box(std::uint32_t tile_column, std::uint32_t tile_row) const {
  const Voxel low{tile_column * tile_size_[0], tile_row * tile_size_[1], first_layer_};
  return {low, {low[0] + tile_size_[0], low[1] + tile_size_[1], first_layer_ + tile_size_[2]}};
}

/// The child of a split node that holds a voxel; `box`, the node's, becomes the child's.
std::uint32_t TileTree::enter_child(const Node& split, const Voxel& voxel, VoxelBox& box) {
  std::uint32_t child = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(split.split_axes >> a & 1)) continue;
    const std::uint32_t middle = (box.low[a] + box.high[a]) / 2;
    const bool high = voxel[a] >= middle;
    (high ? box.low : box.high)[a] = middle;
    child |= (high ? 1u : 0u) << a;
  }
  return child;
}

std::optional<TileTree::Cubics> TileTree::cubics_at(const Voxel& voxel) const {
  const std::uint32_t tile_column = voxel[0] / tile_size_[0], tile_row = voxel[1] / tile_size_[1];
  VoxelBox box = tile_box(tile_column, tile_row);
  const Node* node = &tile(tile_column, tile_row);
  while (node->kind == Node::Kind::kSplit) node = &children_[node->index + enter_child(*node, voxel, box)];
  if (node->kind != Node::Kind::kPolynomial) return std::nullopt;
  return cubics(node->index);
}

void TileTree::clear(std::uint32_t first_layer) {
  first_layer_ = first_layer;
  tiles_.assign(std::size_t{tile_columns_} * tile_rows_, Node{});
  children_.clear();
  fits_.clear();
  polynomials_.clear();
  hints_.clear();
}

TileTree::Node TileTree::add_polynomials(const VoxelFrame& frame, std::span<const CubicPolynomial> polynomials) {
  fits_.push_back({frame, polynomials_.size()});
  polynomials_.insert(polynomials_.end(), polynomials.begin(), polynomials.end());
  return {Node::Kind::kPolynomial, 0, static_cast<std::uint32_t>(fits_.size() - 1)};
}

TileTree::Node TileTree::add_exact(const std::optional<CellParam>& hint) {
  hints_.push_back(hint);
  return {Node::Kind::kExact, 0, static_cast<std::uint32_t>(hints_.size() - 1)};
}

TileTree::Node TileTree::add_split(std::uint8_t axes) {
  const Node node{Node::Kind::kSplit, axes, static_cast<std::uint32_t>(children_.size())};
  children_.resize(children_.size() + 8);
  return node;
}

}  // namespace ccslice
