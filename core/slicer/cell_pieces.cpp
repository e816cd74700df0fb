// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cell_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>
#include <utility>

#include "core/base/prefetch.h"
#include "core/limit/solid_data.h"
#include "core/slicer/layer_slicer.h"

namespace ccslice {
namespace {

// Smaller cells, in voxels, are left to whoever fits across cells: that fails early beside irregular lines only.
constexpr double kSmallestRegularCell = 5000, kSmallestIrregularCell = 600;
constexpr std::uint32_t kTimesTogether = 4;  // Windows are so many times larger than the one before, up to whole slabs.
constexpr std::size_t kNoWindow = std::numeric_limits<std::size_t>::max();
constexpr double kMargin = 0.2;  // Of a cell's size: its parts' places end that near to its box.

}  // namespace

CellPieces::CellPieces(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                       std::shared_ptr<PieceStore> store, const RowRange& rows)
    : solid_(std::move(solid)),
      grid_(spec.grid),
      rows_(rows),
      voxel_of_mesh_(voxel_of_mesh(spec.placement, spec.grid)),
      mesh_of_voxel_(voxel_of_mesh_.inverse(Eigen::Affine)),
      smallest_regular_mm3_(kSmallestRegularCell * std::abs(mesh_of_voxel_.linear().determinant())),
      smallest_irregular_mm3_(kSmallestIrregularCell * std::abs(mesh_of_voxel_.linear().determinant())),
      some_are_small_(solid_->data().regular_volumes.least < smallest_regular_mm3_ ||
                      solid_->data().irregular_volumes.least < smallest_irregular_mm3_),
      all_are_small_(solid_->data().regular_volumes.most < smallest_regular_mm3_ &&
                     solid_->data().irregular_volumes.most < smallest_irregular_mm3_),
      voxel_in_mesh_mm_(mesh_of_voxel_.linear().colwise().norm().maxCoeff()),
      channels_(spec.channels),
      store_(std::move(store)),
      fitter_(solid_, spec) {}

void CellPieces::start(std::uint32_t first_layer, std::uint32_t end_layer) {
  first_layer_ = first_layer;
  end_layer_ = end_layer;
  windows_.clear();
  window_of_layer_.assign(end_layer - first_layer, kNoWindow);
  pieces_.clear();
  polynomials_.clear();
  beyonds_.clear();
  found_.clear();
  runs_.resize(end_layer - first_layer);
  for (std::vector<ScannedRun>& runs : runs_) runs.clear();
}

void CellPieces::find(std::uint32_t layer, const CancellationToken& cancel) {
  if (window_of_layer_[layer - first_layer_] != kNoWindow) return;
  start_window(layer);
  collect_cells();
  collect_parts(cancel);
  scan_pieces(cancel);
  window_.hole_boxes = BoxTree(hole_boxes_, cancel);
  window_.end_piece = pieces_.size();
  windows_.push_back(std::move(window_));
  for (; layer < windows_.back().end_layer; ++layer) window_of_layer_[layer - first_layer_] = windows_.size() - 1;
  layers_together_ = std::min(kTimesTogether * layers_together_, kSlabLayers);
}

/// Forgets what a window before that was cancelled may have left.
void CellPieces::start_window(std::uint32_t first_layer) {
  window_ = {};
  window_.first_layer = first_layer;
  hole_boxes_.clear();
  const std::size_t pieces = windows_.empty() ? 0 : windows_.back().end_piece;
  found_.resize(pieces);
  pieces_.resize(pieces);
  beyonds_.resize(pieces == 0 ? 0 : pieces_.back().first_beyond + pieces_.back().beyond_count);
  polynomials_.resize(pieces * channels_.size());
  std::uint32_t& end = window_.end_layer = first_layer;
  do {
    runs_[end - first_layer_].clear();
    ++end;
  } while (end < end_layer_ && end - first_layer < layers_together_ &&
           window_of_layer_[end - first_layer_] == kNoWindow);
}

const CellPieces::Window& CellPieces::window_of(const Vec3& voxel) const {
  return windows_[window_of_layer_[static_cast<std::uint32_t>(voxel.z()) - first_layer_]];
}

/// Those whose boxes meet the window, and whose pieces or holes may meet the rows, by id. None that is small is needed.
void CellPieces::collect_cells() {
  const BoxTree& boxes = solid_->data().cell_boxes;
  const Box3 slab(Vec3(-1, -1, window_.first_layer - 1.0),
                  Vec3(grid_.extent.columns, grid_.extent.rows, static_cast<double>(window_.end_layer)));
  cells_.clear();
  if (all_are_small_) return;
  boxes.any_meeting(slab.transformed(mesh_of_voxel_), [&](std::uint32_t cell) {
    const Box3 voxels = boxes.box(cell).transformed(voxel_of_mesh_);
    if (voxels.intersects(slab) && meets_rows(voxels)) cells_.push_back(cell);
    return false;
  });
  std::sort(cells_.begin(), cells_.end());
}

bool CellPieces::meets_rows(const Box3& cell) const {
  const double margin = kMargin * cell.diagonal().norm() + 1;
  return cell.max().y() + margin >= rows_.begin && cell.min().y() - margin <= rows_.end;
}

bool CellPieces::is_small(std::uint32_t cell) const {
  const bool regular = solid_->cell_class(cell) == CellClass::kRegular;
  return solid_->data().volume_mm3(cell) < (regular ? smallest_regular_mm3_ : smallest_irregular_mm3_);
}

Box3 CellPieces::place_of(std::uint32_t cell) const {
  const Box3 box = solid_->data().cell_boxes.box(cell).transformed(voxel_of_mesh_);
  return Box3(box.min() - Vec3::Ones(), box.max() + Vec3::Ones());
}

/// Cells that another worker has in hand come last: what it finds out needn't be found out again.
void CellPieces::collect_parts(const CancellationToken& cancel) {
  const auto first = static_cast<std::ptrdiff_t>(pieces_.size());
  busy_cells_.clear();
  for (const std::uint32_t cell : cells_) {
    if (is_small(cell)) continue;
    const std::shared_ptr<CellParts> known = store_->parts_of(cell, place_of(cell));
    if (const std::unique_lock lock(known->mutex, std::try_to_lock); lock) {
      collect_parts_of(cell, *known, cancel);
    } else {
      busy_cells_.push_back(cell);
    }
  }
  for (const std::uint32_t cell : busy_cells_) {
    const std::shared_ptr<CellParts> known = store_->parts_of(cell, place_of(cell));
    const std::scoped_lock lock(known->mutex);
    collect_parts_of(cell, *known, cancel);
  }
  std::stable_sort(found_.begin() + first, found_.end(),
                   [](const Found& a, const Found& b) { return a.cell < b.cell; });
}

/// Pieces and holes that meet the window.
void CellPieces::collect_parts_of(std::uint32_t cell, CellParts& known, const CancellationToken& cancel) {
  std::vector<CellPart>& parts = known.parts;
  bool examined = false;
  parts_.assign(1, 0);
  while (!parts_.empty()) {
    const std::uint32_t at = parts_.back();
    parts_.pop_back();
    if (!meets_window(parts[at].place)) continue;
    if (parts[at].kind == CellPart::Kind::kUnknown) {
      cancel.throw_if_cancelled();
      fitter_.examine(cell, parts, at);
      examined = true;
      if (!meets_window(parts[at].place)) continue;
    }
    const CellPart& part = parts[at];
    if (part.kind == CellPart::Kind::kPiece)
      found_.push_back({cell, part.place.min().z(), part.place.max().z(), part.piece});
    if (part.kind == CellPart::Kind::kHole) {
      hole_boxes_.push_back(part.place);
      window_.holes.push_back({cell, part.map});
    }
    for (std::uint32_t child = part.end_child; child > part.first_child; --child) parts_.push_back(child - 1);
  }
  if (examined) store_->set_memory(cell, known);
}

bool CellPieces::meets_window(const Box3& voxels) const {
  return voxels.intersects(Box3(Vec3(0, 0, window_.first_layer),
                                Vec3(grid_.extent.columns - 1.0, grid_.extent.rows - 1.0, window_.end_layer - 1.0)));
}

void CellPieces::scan_pieces(const CancellationToken& cancel) {
  for (std::size_t f = pieces_.size(); f < found_.size(); ++f) {
    cancel.throw_if_cancelled();
    const Found& found = found_[f];
    if (f + 1 < found_.size()) prefetch(found_[f + 1].piece.get());
    const auto p = static_cast<std::uint32_t>(pieces_.size());
    const auto first_beyond = static_cast<std::uint32_t>(beyonds_.size());
    beyonds_.insert(beyonds_.end(), found.piece->beyond.begin(), found.piece->beyond.end());
    pieces_.push_back({found.piece->frame, static_cast<float>(found.piece->error),
                       static_cast<float>(found.piece->reach), first_beyond,
                       static_cast<std::uint16_t>(found.piece->beyond.size()), found.piece->at_boundary});
    polynomials_.insert(polynomials_.end(), found.piece->polynomials.begin(), found.piece->polynomials.end());
    scanned_.clear();
    // Not beyond the part's place: what is there was looked for in the layers that it meets, no others.
    const VoxelWindow window{
        grid_.extent.columns, grid_.extent.rows,
        static_cast<std::uint32_t>(std::max<double>(window_.first_layer, std::ceil(found.low))),
        static_cast<std::uint32_t>(std::min<double>(window_.end_layer, std::floor(found.high) + 1))};
    raster_.scan(found.piece->points, found.piece->step, window, scanned_);
    for (const BlockRun& run : scanned_) {
      runs_[run.layer - first_layer_].push_back({{run.row, run.begin, run.end, p}, run.before, run.after});
    }
  }
}

/// By the boxes of all cells, whatever the window: its own don't tell what lies just above.
bool CellPieces::is_in_small_cell(const Vec3& voxel) const {
  if (!some_are_small_ || all_are_small_) return all_are_small_;
  const Vec3 point = mesh_of_voxel_ * voxel, margin = Vec3::Constant(voxel_in_mesh_mm_);
  return solid_->data().cell_boxes.any_meeting(Box3(point - margin, point + margin),
                                               [&](std::uint32_t cell) { return is_small(cell); });
}

bool CellPieces::is_in_hole(const Vec3& voxel) const {
  return window_of(voxel).hole_boxes.any_at(voxel, 0) || is_in_small_cell(voxel);
}

bool CellPieces::is_in_large_hole(const Vec3& voxel) const {
  const Window& window = window_of(voxel);
  return is_in_small_cell(voxel) ||
         window.hole_boxes.any_meeting(Box3(voxel, voxel), [&](std::uint32_t h) { return !window.holes[h].map; });
}

/// Of the hole whose middle is nearest; of several, in the lowest cell, or else the first by its middle's coordinates.
std::optional<CellParam> CellPieces::parameter_in_hole(const Vec3& voxel) const {
  if (is_in_large_hole(voxel)) return std::nullopt;
  std::optional<CellParam> nearest;
  std::tuple<double, std::uint32_t, double, double, double> nearest_order;
  const Window& window = window_of(voxel);
  window.hole_boxes.visit_at(voxel, 0, [&](std::uint32_t hole) {
    const auto& [cell, map] = window.holes[hole];
    const double distance = (voxel - map->voxel).squaredNorm();
    const std::tuple order(distance, cell, map->voxel.x(), map->voxel.y(), map->voxel.z());
    if (nearest && nearest_order <= order) return;
    nearest_order = order;
    nearest = CellParam{cell, (*map)(voxel)};
  });
  return nearest;
}

CellParam CellPieces::parameter_near(std::uint32_t piece, const Vec3& voxel) const {
  const Found& found = found_[piece];
  return {found.cell, found.piece->parameters(voxel)};
}

bool CellPieces::agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const {
  const Vec3 at_a = piece(a).frame(voxel), at_b = piece(b).frame(voxel);
  const double share = 1 - std::max(piece(a).error, piece(b).error);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double difference = value_at(polynomials(a)[c], at_a) - value_at(polynomials(b)[c], at_b);
    if (!(std::abs(difference) <= share * channels_[c].tolerance)) return false;
  }
  return true;
}

bool CellPieces::none_is_beyond(std::uint32_t piece, const Vec3& first, const Vec3& last) const {
  const SlabPiece& slab_piece = pieces_[piece];
  const Vec3 from = slab_piece.frame(first), to = slab_piece.frame(last);
  return std::ranges::all_of(beyonds(slab_piece), [&](const CubicPolynomial& beyond) {
    return bound_along_row(along_row(beyond, from.y(), from.z()), from.x(), to.x()) <= 0;
  });
}

bool CellPieces::may_be_beyond(std::uint32_t piece, const Vec3& voxel) const {
  const Vec3 at = pieces_[piece].frame(voxel);
  return std::ranges::any_of(beyonds(pieces_[piece]),
                             [&](const CubicPolynomial& beyond) { return !(value_at(beyond, at) <= 0); });
}

}  // namespace ccslice
