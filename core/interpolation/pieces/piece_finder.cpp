// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/piece_finder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/prefetch.h"
#include "core/job/slice_job.h"
#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kTimesTogether = 4;  // Groups are so many times larger than the one before, up to whole slabs.
constexpr double kMarginOfCell = 0.2;  // How far nodes' bounds may reach beyond their cell's box, as a share of it.
constexpr std::uint32_t kNodesPerPoll = 64;

}  // namespace

PieceFinder::PieceFinder(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                         std::shared_ptr<CellNodeStore> store, const RowRange& rows,
                         std::shared_ptr<VoxelBlocks> blocks)
    : solid_(std::move(solid)),
      grid_(spec.grid),
      rows_(rows),
      voxel_of_mesh_(voxel_of_mesh(spec.placement, spec.grid)),
      mesh_of_voxel_(voxel_of_mesh_.inverse(Eigen::Affine)),
      store_(std::move(store)),
      fitter_(solid_, spec, std::move(blocks)) {}

void PieceFinder::find(std::uint32_t layer, SlabPieces& pieces, const CancellationToken& cancel) {
  if (pieces.is_found(layer)) return;
  if (!std::exchange(has_begun_, true)) {
    if (const auto awaited = store_->awaited_layer(layer)) help_with(*awaited, pieces.small_cells(), cancel);
  }
  group_ = {};
  group_.first_layer = layer;
  group_.end_layer = pieces.start_group(layer, layers_together_);
  collect_cells(pieces.small_cells());
  collect_nodes(cancel);
  store_->set_found(layer);
  scan_pieces(pieces, cancel);
  pieces.finish_group(layer, group_.end_layer, std::move(group_.holes), group_.hole_boxes, cancel);
  layers_together_ = std::min(kTimesTogether * layers_together_, kSlabLayers);
}

/// Examines nodes that another worker needs, the last cells first, as that one comes from the first ones.
void PieceFinder::help_with(std::uint32_t layer, const SmallCells& small, const CancellationToken& cancel) {
  group_ = {};
  group_.first_layer = layer;
  group_.end_layer = layer + 1;
  collect_cells(small);
  for (std::size_t c = cells_.size(); c-- > 0;) {
    cancel.throw_if_cancelled();
    const std::shared_ptr<CellNodes> known = store_->nodes_of(cells_[c], bounds_of(cells_[c]));
    std::unique_lock lock(known->mutex, std::try_to_lock);
    if (lock) collect_nodes_of(cells_[c], *known, lock, cancel);
  }
}

/// Finds the cells that aren't small, whose boxes meet the group, and whose pieces or holes may meet the rows; by id.
void PieceFinder::collect_cells(const SmallCells& small) {
  const FloatBoxTree& boxes = solid_->index().cell_boxes;
  const Box3 layers(Vec3(-1, -1, group_.first_layer - 1.0),
                    Vec3(grid_.extent.columns, grid_.extent.rows, static_cast<double>(group_.end_layer)));
  cells_.clear();
  if (small.are_all()) return;
  boxes.any_meeting(layers.transformed(mesh_of_voxel_), [&](std::uint32_t cell) {
    const Box3 voxels = boxes.box(cell).transformed(voxel_of_mesh_);
    if (voxels.intersects(layers) && meets_rows(voxels)) cells_.emplace_back(cell);
    return false;
  });
  std::erase_if(cells_, [&](LimitCellId cell) { return small.contain(cell); });
  std::sort(cells_.begin(), cells_.end());
}

bool PieceFinder::meets_rows(const Box3& cell) const {
  const double margin = kMarginOfCell * cell.diagonal().norm() + 1;
  return cell.max().y() + margin >= rows_.begin && cell.min().y() - margin <= rows_.end;
}

Box3 PieceFinder::bounds_of(LimitCellId cell) const {
  const Box3 box = solid_->index().cell_boxes.box(cell).transformed(voxel_of_mesh_);
  return Box3(box.min() - Vec3::Ones(), box.max() + Vec3::Ones());
}

/// Cells that another worker has in hand come last: what it finds out needn't be found out again.
void PieceFinder::collect_nodes(const CancellationToken& cancel) {
  busy_cells_.clear();
  for (const LimitCellId cell : cells_) {
    cancel.throw_if_cancelled();
    const std::shared_ptr<CellNodes> known = store_->nodes_of(cell, bounds_of(cell));
    if (std::unique_lock lock(known->mutex, std::try_to_lock); lock) {
      collect_nodes_of(cell, *known, lock, cancel);
    } else {
      busy_cells_.push_back(cell);
    }
  }
  for (const LimitCellId cell : busy_cells_) {
    cancel.throw_if_cancelled();
    const std::shared_ptr<CellNodes> known = store_->nodes_of(cell, bounds_of(cell));
    std::unique_lock lock(known->mutex);
    collect_nodes_of(cell, *known, lock, cancel);
  }
  std::ranges::stable_sort(group_.pieces, {}, &Found::cell);
}

/// Pieces and holes that meet the group. What isn't known yet is examined, and kept. `lock` is that of the nodes; it is
/// let go of now and then, while others may add nodes too.
void PieceFinder::collect_nodes_of(LimitCellId cell, CellNodes& known, std::unique_lock<std::mutex>& lock,
                                   const CancellationToken& cancel) {
  std::vector<CellNode>& nodes = known.nodes;
  std::uint32_t examined = 0;
  nodes_.assign(1, 0);
  while (!nodes_.empty()) {
    const std::uint32_t at = nodes_.back();
    nodes_.pop_back();
    if (!meets_group(nodes[at].bounds)) continue;
    if (nodes[at].kind == CellNode::Kind::kUnknown) {
      if (++examined % kNodesPerPoll == 0) {
        lock.unlock();
        cancel.throw_if_cancelled();
        lock.lock();
      }
      if (nodes[at].kind == CellNode::Kind::kUnknown) fitter_.examine(cell, nodes, at);
      if (!meets_group(nodes[at].bounds)) continue;
    }
    const CellNode& node = nodes[at];
    if (node.kind == CellNode::Kind::kPiece) {
      group_.pieces.push_back({cell, node.bounds.min().z(), node.bounds.max().z(), node.piece});
    }
    if (node.kind == CellNode::Kind::kHole) {
      group_.hole_boxes.push_back(node.bounds);
      group_.holes.push_back({cell, node.map});
    }
    // The first child next, so that pieces come in the same order for any history of the store.
    for (std::uint32_t child = node.end_child; child > node.first_child; --child) nodes_.push_back(child - 1);
  }
  if (examined > 0) store_->set_memory(cell, known);
}

bool PieceFinder::meets_group(const Box3& voxels) const {
  return voxels.intersects(Box3(Vec3(0, 0, group_.first_layer),
                                Vec3(grid_.extent.columns - 1.0, grid_.extent.rows - 1.0, group_.end_layer - 1.0)));
}

void PieceFinder::scan_pieces(SlabPieces& pieces, const CancellationToken& cancel) {
  for (std::size_t f = 0; f < group_.pieces.size(); ++f) {
    cancel.throw_if_cancelled();
    const Found& found = group_.pieces[f];
    if (f + 1 < group_.pieces.size()) prefetch(group_.pieces[f + 1].piece.get());
    scanned_.clear();
    // Not beyond the node's bounds: what is there was looked for in the layers that they meet, no others.
    const ScanBounds bounds{grid_.extent.columns, grid_.extent.rows,
                            static_cast<std::uint32_t>(std::max<double>(group_.first_layer, std::ceil(found.low))),
                            static_cast<std::uint32_t>(std::min<double>(group_.end_layer, std::floor(found.high) + 1))};
    raster_.scan(found.piece->points, found.piece->step, bounds, scanned_);
    pieces.add_piece(found.cell, found.piece, scanned_);
  }
}

}  // namespace ccslice
