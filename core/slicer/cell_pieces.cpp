// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cell_pieces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr double kShareOfTolerance = 0.45;  // What errors at the nodes may take of it.
// Smaller cells, in voxels, are left to whoever fits across cells: that fails early beside irregular lines only.
constexpr double kSmallestRegularCell = 5000, kSmallestIrregularCell = 600;
constexpr double kSmallestPiece = 128;       // Parts of fewer voxels aren't halved any more.
constexpr double kSmallestPredicted = 16;    // Nor are parts whose pieces would have fewer than this.
constexpr double kSmallestAmbiguous = 2048;  // Nor parts of fewer that may fold.
constexpr double kMostRows = 1024;           // Of a piece.
constexpr double kMostReach = 8;             // Columns.
constexpr double kMargin = 0.06;             // Of a block's size: its faces lie that near to its nodes' box.
constexpr std::size_t kPatchCacheBytes = 8 << 20;
constexpr unsigned kAllAxes = 7;

Placement voxel_of_mesh(const Placement& placement, const Grid& grid) {
  const Vec3 pitch(grid.pitch.x_mm, grid.pitch.y_mm, grid.pitch.z_mm);
  Placement result;
  result.linear() = pitch.cwiseInverse().asDiagonal() * placement.linear();
  result.translation() = (placement.translation() - grid.origin_mm).cwiseQuotient(pitch) - Vec3::Constant(0.5);
  return result;
}

std::vector<std::uint32_t> channel_ids(std::span<const ChannelTolerance> channels) {
  std::vector<std::uint32_t> ids;
  for (const ChannelTolerance& channel : channels) ids.push_back(channel.channel);
  return ids;
}

Box3 grown(const Box3& box) {
  const Vec3 margin = kMargin * box.diagonal() + Vec3::Ones();
  return Box3(box.min() - margin, box.max() + margin);
}

double value_at(const CubicPolynomial& polynomial, const Vec3& place) {
  const std::array<double, 4> c = along_row(polynomial, place.y(), place.z());
  return ((c[3] * place.x() + c[2]) * place.x() + c[1]) * place.x() + c[0];
}

}  // namespace

CellPieces::CellPieces(std::shared_ptr<const LimitSolid> solid, const Placement& placement, const Grid& grid,
                       std::vector<ChannelTolerance> channels)
    : solid_(std::move(solid)),
      grid_(grid),
      voxel_of_mesh_(voxel_of_mesh(placement, grid)),
      mesh_of_voxel_(voxel_of_mesh_.inverse(Eigen::Affine)),
      channels_(std::move(channels)),
      evaluator_(*solid_, kPatchCacheBytes),
      sampler_(evaluator_, channel_ids(channels_)) {}

void CellPieces::build(std::uint32_t first_layer, std::uint32_t end_layer, const CancellationToken& cancel) {
  first_layer_ = first_layer;
  end_layer_ = end_layer;
  pieces_.clear();
  polynomials_.clear();
  hole_boxes_.clear();
  runs_.resize(end_layer - first_layer);
  for (std::vector<PieceRun>& runs : runs_) runs.clear();
  collect_cells();
  for (const std::uint32_t cell : cells_) {
    if (is_small(cell)) {
      hole_boxes_.push_back(grown(solid_->data().cell_boxes.box(cell).transformed(voxel_of_mesh_)));
    } else {
      add(cell, {}, cancel);
    }
  }
  holes_ = pieces_.empty() ? BoxTree() : BoxTree(hole_boxes_, cancel);
}

/// Those whose boxes meet the slab, by id.
void CellPieces::collect_cells() {
  const BoxTree& boxes = solid_->data().cell_boxes;
  const Box3 slab(Vec3(-1, -1, first_layer_ - 1.0),
                  Vec3(grid_.extent.columns, grid_.extent.rows, static_cast<double>(end_layer_)));
  cells_.clear();
  boxes.any_meeting(slab.transformed(mesh_of_voxel_), [&](std::uint32_t cell) {
    if (boxes.box(cell).transformed(voxel_of_mesh_).intersects(slab)) cells_.push_back(cell);
    return false;
  });
  std::sort(cells_.begin(), cells_.end());
}

bool CellPieces::is_small(std::uint32_t cell) const {
  const double mesh_of_cell = 1 / solid_->data().cell_maps[cell].inverse_jacobian.determinant();
  const bool regular = solid_->cell_class(cell) == CellClass::kRegular;
  const double smallest = regular ? kSmallestRegularCell : kSmallestIrregularCell;
  return std::abs(voxel_of_mesh_.linear().determinant() * mesh_of_cell) < smallest;
}

void CellPieces::add(std::uint32_t cell, const ParamBox& box, const CancellationToken& cancel) {
  cancel.throw_if_cancelled();
  sample(cell, box);
  const BlockShape shape = shape_of(points_);
  if (!meets_slab(grown(shape.box))) return;
  const unsigned axes = fit_or_split(shape);
  for (unsigned child = 0; axes != 0 && child < 8; ++child) {
    if (child & ~axes) continue;
    ParamBox part = box;
    for (int a = 0; a < 3; ++a) {
      if (!(axes >> a & 1)) continue;
      (child >> a & 1 ? part.low : part.high)[a] = 0.5 * (box.low[a] + box.high[a]);
    }
    add(cell, part, cancel);
  }
}

/// Fills block_, and its points in voxels.
void CellPieces::sample(std::uint32_t cell, const ParamBox& box) {
  sampler_.sample(cell, box, block_);
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    for (std::size_t g = 0; g < kBlockGroups; ++g) {
      Lanes voxel = block_.position[0][g] * voxel_of_mesh_.linear()(a, 0) + voxel_of_mesh_.translation()[a];
      for (int b = 1; b < 3; ++b) {
        voxel = multiply_add(block_.position[static_cast<std::size_t>(b)][g], voxel_of_mesh_.linear()(a, b), voxel);
      }
      places_[i][g] = voxel;
    }
  }
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const std::size_t slot = block_slot(n), group = slot / kLanes, lane = slot % kLanes;
    points_[n] = {places_[0][group][lane], places_[1][group][lane], places_[2][group][lane]};
  }
}

bool CellPieces::meets_slab(const Box3& voxels) const {
  return voxels.intersects(
      Box3(Vec3(0, 0, first_layer_), Vec3(grid_.extent.columns - 1.0, grid_.extent.rows - 1.0, end_layer_ - 1.0)));
}

/// Makes a piece of the block, or a hole. Or else returns the axes to halve it along.
unsigned CellPieces::fit_or_split(const BlockShape& shape) {
  const auto leave_out = [&] {
    hole_boxes_.push_back(grown(shape.box));
    return 0u;
  };
  if (solid_->data().is_ambiguous(grown(shape.box).transformed(mesh_of_voxel_))) {
    return shape.voxels > kSmallestAmbiguous ? kAllAxes : leave_out();
  }
  if (shape.flat) return leave_out();
  if (shape.box.diagonal().y() > kMostRows) return kAllAxes;
  const TileFrame frame = TileFrame::of(shape.box.min(), shape.box.max());
  const std::size_t first_polynomial = polynomials_.size();
  const double error = fit(frame);
  if (error <= 1 && shape.bent_axes == 0) {
    add_piece(shape, frame, first_polynomial);
    return 0;
  }
  polynomials_.resize(first_polynomial);
  // Errors of cubics fall with the fourth power of the size, so voxels of pieces with the third of its root.
  const double predicted = shape.voxels / std::max(1.0, std::pow(error, 0.75));
  if (shape.voxels < kSmallestPiece || predicted < kSmallestPredicted) return leave_out();
  return axes_to_halve(shape, error <= 1, error);
}

/// Halving along one axis is enough where little is missing.
unsigned CellPieces::axes_to_halve(const BlockShape& shape, bool fits, double error) const {
  constexpr double kLittle = 4, kLikeTheWorst = 0.6, kTheWorst = 0.99;
  if (fits) return shape.bent_axes;
  return shape.bent_axes | fitter_.axes_to_halve(error < kLittle ? kTheWorst : kLikeTheWorst);
}

/// Appends polynomials. Returns the error as a share of what is allowed, of the first channel that is beyond it.
double CellPieces::fit(const TileFrame& frame) {
  for (int a = 0; a < 3; ++a) {
    for (Lanes& place : places_[static_cast<std::size_t>(a)]) place = (place - frame.centre[a]) * frame.scale[a];
  }
  fitter_.factorize(places_);
  double worst = 0;
  for (std::size_t c = 0; c < channels_.size() && worst <= 1; ++c) {
    polynomials_.emplace_back();
    const double error = fitter_.fit(block_.values[c], polynomials_.back());
    worst = std::max(worst, error / (kShareOfTolerance * channels_[c].tolerance));
  }
  return worst;
}

void CellPieces::add_piece(const BlockShape& shape, const TileFrame& frame, std::size_t first_polynomial) {
  scanned_.clear();
  raster_.scan(points_, {grid_.extent.columns, grid_.extent.rows, first_layer_, end_layer_}, scanned_);
  const auto piece = static_cast<std::uint32_t>(pieces_.size());
  for (const VoxelRun& run : scanned_) runs_[run.layer - first_layer_].push_back({run.row, run.begin, run.end, piece});
  pieces_.push_back({frame, first_polynomial, static_cast<std::uint32_t>(std::min(shape.reach(), kMostReach))});
}

bool CellPieces::agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const {
  const Vec3 at_a = pieces_[a].frame(voxel), at_b = pieces_[b].frame(voxel);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double difference = value_at(polynomials(a)[c], at_a) - value_at(polynomials(b)[c], at_b);
    if (!(std::abs(difference) <= 2 * kShareOfTolerance * channels_[c].tolerance)) return false;
  }
  return true;
}

}  // namespace ccslice
