// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/slab_pieces.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace ccslice {

namespace {

/// Much more than evaluating the polynomial is off by, in any order.
double rounding_of(const CubicPolynomial& polynomial) {
  constexpr double kRounding = 1e-9;
  double size = 1;
  for (const double coefficient : polynomial) size += std::abs(coefficient);
  return kRounding * size;
}

}  // namespace

SlabPieces::SlabPieces(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec, bool tiles_fit)
    : channels_(spec.channels),
      small_cells_(std::move(solid), voxel_of_mesh(spec.placement, spec.grid).inverse(Eigen::Affine), tiles_fit) {}

void SlabPieces::start(std::uint32_t first_layer, std::uint32_t end_layer) {
  first_layer_ = first_layer;
  end_layer_ = end_layer;
  groups_.clear();
  group_of_layer_.assign(end_layer - first_layer, kNoGroup);
  pieces_.clear();
  polynomials_.clear();
  beyonds_.clear();
  beyond_roundings_.clear();
  sources_.clear();
  runs_.resize(end_layer - first_layer);
  for (std::vector<ScannedRun>& runs : runs_) runs.clear();
}

std::uint32_t SlabPieces::start_group(std::uint32_t first_layer, std::uint32_t most_layers) {
  const std::size_t pieces = groups_.empty() ? 0 : groups_.back().end_piece;
  sources_.resize(pieces);
  pieces_.resize(pieces);
  beyonds_.resize(pieces == 0 ? 0 : pieces_.back().first_beyond + pieces_.back().beyond_count);
  beyond_roundings_.resize(beyonds_.size());
  polynomials_.resize(pieces * channels_.size());
  std::uint32_t end = first_layer;
  do {
    runs_[end - first_layer_].clear();
    ++end;
  } while (end < end_layer_ && end - first_layer < most_layers && !is_found(end));
  return end;
}

void SlabPieces::add_piece(LimitCellId cell, std::shared_ptr<const CellPiece> piece, std::span<const BlockRun> runs) {
  const auto index = static_cast<std::uint32_t>(pieces_.size());
  const auto first_beyond = static_cast<std::uint32_t>(beyonds_.size());
  for (const CubicPolynomial& beyond : piece->beyond) {
    beyonds_.push_back(beyond);
    beyond_roundings_.push_back(rounding_of(beyond));
  }
  pieces_.push_back({piece->frame, static_cast<float>(piece->error), static_cast<float>(piece->reach), first_beyond,
                     static_cast<std::uint16_t>(piece->beyond.size()), piece->at_boundary});
  polynomials_.insert(polynomials_.end(), piece->polynomials.begin(), piece->polynomials.end());
  sources_.push_back({cell, std::move(piece)});
  for (const BlockRun& run : runs) {
    runs_[run.layer - first_layer_].push_back({{{run.row, run.begin, run.end}, index}, run.before, run.after});
  }
}

void SlabPieces::finish_group(std::uint32_t first_layer, std::uint32_t end_layer, std::vector<Hole> holes,
                              std::span<const Box3> hole_boxes, const CancellationToken& cancel) {
  groups_.push_back({std::move(holes), BoxTree(hole_boxes, cancel), pieces_.size()});
  for (std::uint32_t layer = first_layer; layer < end_layer; ++layer) {
    group_of_layer_[layer - first_layer_] = groups_.size() - 1;
  }
}

bool SlabPieces::is_in_hole(const Vec3& voxel) const {
  return group_of(voxel).hole_boxes.any_at(voxel, 0) || small_cells_.any_at(voxel);
}

bool SlabPieces::is_for_tiles(const Vec3& voxel) const {
  const Group& group = group_of(voxel);
  return small_cells_.any_at(voxel) ||
         group.hole_boxes.any_meeting(Box3(voxel, voxel), [&](std::uint32_t h) { return !group.holes[h].map; });
}

/// It is guessed by the map of the hole whose middle is nearest; of several, in the lowest cell, or else the first by
/// its middle's coordinates.
std::optional<CellParam> SlabPieces::parameter_in_hole(const Vec3& voxel) const {
  if (is_for_tiles(voxel)) return std::nullopt;
  std::optional<CellParam> nearest;
  std::tuple<double, std::uint32_t, double, double, double> nearest_order;
  const Group& group = group_of(voxel);
  group.hole_boxes.visit_at(voxel, 0, [&](std::uint32_t hole) {
    const auto& [cell, map] = group.holes[hole];
    const double distance = (voxel - map->voxel).squaredNorm();
    const std::tuple order(distance, cell, map->voxel.x(), map->voxel.y(), map->voxel.z());
    if (nearest && nearest_order <= order) return;
    nearest_order = order;
    nearest = CellParam{cell, (*map)(voxel)};
  });
  return nearest;
}

CellParam SlabPieces::parameter_near(std::uint32_t piece, const Vec3& voxel) const {
  const Source& source = sources_[piece];
  return {source.cell, source.piece->parameters(voxel)};
}

bool SlabPieces::agree(std::uint32_t a, std::uint32_t b, const Vec3& voxel) const {
  const Vec3 at_a = piece(a).frame(voxel), at_b = piece(b).frame(voxel);
  // Whichever piece holds the voxel is within its own error E of what is right, so the other is within E + (1 - E).
  const double share = 1 - std::max(piece(a).error, piece(b).error);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double difference = value_at(polynomials(a)[c], at_a) - value_at(polynomials(b)[c], at_b);
    if (!(std::abs(difference) <= share * channels_[c].tolerance)) return false;
  }
  return true;
}

SlabPieces::Row::Row(const SlabPieces& pieces, std::uint32_t piece, const Vec3& voxel)
    : pieces_(&pieces), piece_(piece) {
  const SlabPiece& slab_piece = pieces.pieces_[piece];
  const Vec3 at = slab_piece.frame(voxel);
  for (std::size_t beyond = slab_piece.first_beyond; sides_ < slab_piece.beyond_count; ++beyond) {
    along_[sides_] = along_row(pieces.beyonds_[beyond], at.y(), at.z());
    rounding_[sides_++] = pieces.beyond_roundings_[beyond];
  }
}

/// The cubics of all sides are so many times their rounding below 0.
bool SlabPieces::Row::is_below(double roundings, const Vec3& first, const Vec3& last) const {
  const VoxelFrame& frame = pieces_->pieces_[piece_].frame;
  const double from = frame(first).x(), to = frame(last).x();
  for (std::size_t side = 0; side < sides_; ++side) {
    if (!(bound_along_row(along_[side], from, to) <= -roundings * rounding_[side])) return false;
  }
  return true;
}

/// Where the cubics along the row leave a doubt, the polynomials in space tell.
bool SlabPieces::Row::may_be_beyond(const Vec3& voxel) const {
  const double x = pieces_->pieces_[piece_].frame(voxel).x();
  bool none = true;
  for (std::size_t side = 0; side < sides_; ++side) {
    const auto& c = along_[side];
    const double value = ((c[3] * x + c[2]) * x + c[1]) * x + c[0];
    if (value > rounding_[side]) return true;
    none = none && value < -rounding_[side];
  }
  return !none && pieces_->may_be_beyond(piece_, voxel);
}

bool SlabPieces::may_be_beyond(std::uint32_t piece, const Vec3& voxel) const {
  const Vec3 at = pieces_[piece].frame(voxel);
  return std::ranges::any_of(beyonds(pieces_[piece]),
                             [&](const CubicPolynomial& beyond) { return !(value_at(beyond, at) <= 0); });
}

}  // namespace ccslice
