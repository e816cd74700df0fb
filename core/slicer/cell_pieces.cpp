// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cell_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

// Smaller cells, in voxels, are left to whoever fits across cells: that fails early beside irregular lines only.
constexpr double kSmallestRegularCell = 5000, kSmallestIrregularCell = 600;
constexpr double kMargin = 0.2;  // Of a cell's size: its parts' places end that near to its box.

}  // namespace

CellPieces::CellPieces(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                       std::shared_ptr<PieceStore> store, const RowRange& rows)
    : solid_(std::move(solid)),
      grid_(spec.grid),
      rows_(rows),
      voxel_of_mesh_(voxel_of_mesh(spec.placement, spec.grid)),
      mesh_of_voxel_(voxel_of_mesh_.inverse(Eigen::Affine)),
      channels_(spec.channels),
      store_(std::move(store)),
      fitter_(solid_, spec) {}

void CellPieces::build(std::uint32_t first_layer, std::uint32_t end_layer, const CancellationToken& cancel) {
  first_layer_ = first_layer;
  end_layer_ = end_layer;
  pieces_.clear();
  polynomials_.clear();
  found_.clear();
  hole_boxes_.clear();
  hole_cells_.clear();
  runs_.resize(end_layer - first_layer);
  for (std::vector<PieceRun>& runs : runs_) runs.clear();
  collect_cells();
  collect_parts(cancel);
  scan_pieces(cancel);
  // Holes of small cells alone say nothing; whether there are others, or pieces, shows in the rows where it matters.
  const bool matters =
      !pieces_.empty() || std::ranges::any_of(hole_cells_, [](const Hole& hole) { return hole.map != nullptr; });
  holes_ = matters ? BoxTree(hole_boxes_, cancel) : BoxTree();
}

/// Those whose boxes meet the slab, and whose pieces or holes may meet the rows, by id.
void CellPieces::collect_cells() {
  const BoxTree& boxes = solid_->data().cell_boxes;
  const Box3 slab(Vec3(-1, -1, first_layer_ - 1.0),
                  Vec3(grid_.extent.columns, grid_.extent.rows, static_cast<double>(end_layer_)));
  cells_.clear();
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
  const double mesh_of_cell = 1 / solid_->data().cell_maps[cell].inverse_jacobian.determinant();
  const bool regular = solid_->cell_class(cell) == CellClass::kRegular;
  const double smallest = regular ? kSmallestRegularCell : kSmallestIrregularCell;
  return std::abs(voxel_of_mesh_.linear().determinant() * mesh_of_cell) < smallest;
}

Box3 CellPieces::place_of(std::uint32_t cell) const {
  const Box3 box = solid_->data().cell_boxes.box(cell).transformed(voxel_of_mesh_);
  return Box3(box.min() - Vec3::Ones(), box.max() + Vec3::Ones());
}

/// Cells that another worker has in hand come last: what it finds out needn't be found out again.
void CellPieces::collect_parts(const CancellationToken& cancel) {
  busy_cells_.clear();
  for (const std::uint32_t cell : cells_) {
    if (is_small(cell)) {
      add_hole(place_of(cell), cell, nullptr);
      continue;
    }
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
  std::stable_sort(found_.begin(), found_.end(), [](const Found& a, const Found& b) { return a.cell < b.cell; });
}

/// Pieces and holes that meet the slab.
void CellPieces::collect_parts_of(std::uint32_t cell, CellParts& known, const CancellationToken& cancel) {
  std::vector<CellPart>& parts = known.parts;
  bool examined = false;
  parts_.assign(1, 0);
  while (!parts_.empty()) {
    const std::uint32_t at = parts_.back();
    parts_.pop_back();
    if (!meets_slab(parts[at].place)) continue;
    if (parts[at].kind == CellPart::Kind::kUnknown) {
      cancel.throw_if_cancelled();
      fitter_.examine(cell, parts, at);
      examined = true;
      if (!meets_slab(parts[at].place)) continue;
    }
    const CellPart& part = parts[at];
    if (part.kind == CellPart::Kind::kPiece) found_.push_back({cell, part.piece});
    if (part.kind == CellPart::Kind::kHole) add_hole(part.place, cell, part.map);
    for (std::uint32_t child = part.end_child; child > part.first_child; --child) parts_.push_back(child - 1);
  }
  if (examined) store_->set_memory(cell, known);
}

void CellPieces::add_hole(const Box3& place, std::uint32_t cell, std::shared_ptr<const ParameterMap> map) {
  hole_boxes_.push_back(place);
  hole_cells_.push_back({cell, std::move(map)});
}

bool CellPieces::meets_slab(const Box3& voxels) const {
  return voxels.intersects(
      Box3(Vec3(0, 0, first_layer_), Vec3(grid_.extent.columns - 1.0, grid_.extent.rows - 1.0, end_layer_ - 1.0)));
}

void CellPieces::scan_pieces(const CancellationToken& cancel) {
  const VoxelWindow window{grid_.extent.columns, grid_.extent.rows, first_layer_, end_layer_};
  for (const Found& found : found_) {
    cancel.throw_if_cancelled();
    const auto p = static_cast<std::uint32_t>(pieces_.size());
    pieces_.push_back({found.piece->frame, found.piece->reach, !found.piece->beyond.empty()});
    polynomials_.insert(polynomials_.end(), found.piece->polynomials.begin(), found.piece->polynomials.end());
    scanned_.clear();
    raster_.scan(found.piece->points, found.piece->step, window, scanned_);
    for (const VoxelRun& run : scanned_) runs_[run.layer - first_layer_].push_back({run.row, run.begin, run.end, p});
  }
}

/// Of the hole whose middle is nearest; of several, in the lowest cell.
std::optional<CellParam> CellPieces::parameter_in_hole(const Vec3& voxel) const {
  std::optional<CellParam> nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  bool known = true;
  holes_.visit_at(voxel, 0, [&](std::uint32_t hole) {
    const auto& [cell, map] = hole_cells_[hole];
    if (map == nullptr) {
      known = false;
      return;
    }
    const double distance = (voxel - map->voxel).squaredNorm();
    if (distance > nearest_distance || (distance == nearest_distance && nearest->cell <= cell)) return;
    nearest_distance = distance;
    nearest = CellParam{cell, (*map)(voxel)};
  });
  return known ? nearest : std::nullopt;
}

CellParam CellPieces::parameter_near(std::uint32_t piece, const Vec3& voxel) const {
  const Found& found = found_[piece];
  return {found.cell, found.piece->parameters(voxel)};
}

bool CellPieces::agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const {
  const Vec3 at_a = piece(a).frame(voxel), at_b = piece(b).frame(voxel);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double difference = value_at(polynomials(a)[c], at_a) - value_at(polynomials(b)[c], at_b);
    if (!(std::abs(difference) <= (1 - kPieceShareOfTolerance) * channels_[c].tolerance)) return false;
  }
  return true;
}

bool CellPieces::may_be_beyond(std::uint32_t piece, const Vec3& voxel) const {
  const CellPiece& found = *found_[piece].piece;
  return std::ranges::any_of(
      found.beyond, [&](const CubicPolynomial& beyond) { return !(value_at(beyond, found.frame(voxel)) <= 0); });
}

}  // namespace ccslice
