// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/face_surroundings.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/field/material_field.h"
#include "core/interpolation/fits/shares.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/limit/cell_gaps.h"
#include "core/limit/cell_index.h"
#include "core/mesh/cell_kind.h"

namespace ccslice {
namespace {

constexpr double kMostJump = 8.0 / 6;  // Of third derivatives, as a share of the range, by the cube of the depth.
// The steepest slope of a channel in a cell comes to no more than this, times its steepest along an axis by the cell's
// thickness in its middle: the axes may be oblique, and the cell thinner elsewhere.
constexpr double kOblique = 3;
constexpr double kDeeper = 1.4;  // Shells may be so much deeper than at the places that BlockShell finds.
// As a share of a patch's thickness that of the next one, which is half as thick in parameters. In millimetres no less
// than 0.35 of it was seen, at vertices of three edges.
constexpr double kThinnestPatch = 1.0 / 3;
constexpr int kMostQuarterings = 2;        // Of a shell's quadrilaterals.
constexpr double kLeastReach = 0.25;       // Columns. A piece isn't followed less far.
constexpr double kOffCell = 1e-6;          // mm. Points that far off a cell aren't in it.
constexpr double kRoundingOfGuess = 1e-6;  // In parameters.

/// Where a jump of third derivatives comes to the tolerance, as a share of a cell.
double sure_share(const LimitSolid& solid, std::span<const ChannelTolerance> channels) {
  double least = std::numeric_limits<double>::infinity();
  for (const ChannelTolerance& channel : channels) {
    const ChannelRange& range = solid.summary().channels[channel.channel];
    const double most = kMostJump * (range.max - range.min);
    least = std::min(least, std::cbrt(channel.tolerance / most));  // Infinite for constants.
  }
  return least;
}

/// Most places beyond faces on the boundary are in no cell.
InversionOptions options_of_inversion(const InterpolationSpec& spec) {
  InversionOptions options =
      inversion_options_of(Eigen::JacobiSVD<Mat3>(spec.placement.linear()).singularValues(), spec.outside_mm);
  options.proves_outside = true;
  return options;
}

/// No slope along an axis of a cell is larger, by the parameter, of a channel that is of degree 2 along each and has
/// these values at 3 x 3 x 3 places: Bezier points bound a polynomial, and their differences its slopes.
double steepest_slope(std::array<double, 27> values) {
  constexpr std::array<std::size_t, 3> kStride = {1, 3, 9};
  for (const std::size_t stride : kStride) {
    for (std::size_t place = 0; place < values.size(); ++place) {
      if (place / stride % 3 != 1) continue;
      values[place] = 2 * values[place] - (values[place - stride] + values[place + stride]) / 2;
    }
  }
  double steepest = 0;
  for (const std::size_t stride : kStride) {
    for (std::size_t place = 0; place < values.size(); ++place) {
      if (place / stride % 3 == 2) continue;
      steepest = std::max(steepest, 2 * std::abs(values[place + stride] - values[place]));
    }
  }
  return steepest;
}

/// 0 where nothing is known of it.
double thickness_of(const CellMap& map) {
  const double thickness_mm = map.thickness_mm();
  return std::isfinite(thickness_mm) ? thickness_mm : 0;
}

/// The sides of a cell, a bit each, that share one of these edges with a side.
unsigned neighbours_at_edges(std::size_t side, unsigned edges) {
  const auto corners = cell_topology(CellKind::kHex).edges;
  unsigned neighbours = 0;
  for (std::size_t e = 0; e < corners.size(); ++e) {
    if (!(edges >> e & 1)) continue;
    unsigned sides = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned at = corners[e][0] >> axis & 1u;
      if (at == (corners[e][1] >> axis & 1u)) sides |= 1u << (2 * axis + at);
    }
    if (sides >> side & 1) neighbours |= sides & ~(1u << side);
  }
  return neighbours;
}

}  // namespace

FaceSurroundings::FaceSurroundings(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec)
    : solid_(std::move(solid)),
      voxel_of_mesh_(voxel_of_mesh(spec.placement, spec.grid)),
      mesh_of_voxel_(voxel_of_mesh_.inverse(Eigen::Affine)),
      channels_(spec.channels),
      inversion_(options_of_inversion(spec)),
      proved_(spec.proved),
      sure_share_(sure_share(*solid_, channels_)),
      values_(solid_->channel_count()) {}

/// Triangles lie within the box of the cell's points.
void FaceSurroundings::collect(LimitCellId cell) {
  if (cell_ == cell) return;
  cell_ = cell;
  touching_.clear();
  others_.clear();
  const auto is_irregular = [this](LimitCellId any) { return solid_->cell_class(any) != CellClass::kRegular; };
  irregular_ = is_irregular(cell);
  least_thickness_mm_ = std::numeric_limits<double>::infinity();
  const CellIndex& index = solid_->index();
  index.cell_boxes.any_meeting(index.cell_boxes.box(cell), [&](std::uint32_t met) {
    const LimitCellId other{met};
    if (other == cell) return false;
    if (solid_->touch(cell, other)) {
      touching_.push_back({other, least_thickness_mm(other)});
      irregular_ = irregular_ || is_irregular(other);
      least_thickness_mm_ = std::min(least_thickness_mm_, touching_.back().thickness_mm);
    } else {
      others_.push_back(other);
    }
    return false;
  });
}

/// What the share of a shell's depth is taken of. Material doesn't go on into another cell region.
double FaceSurroundings::least_thickness_mm(LimitCellId touching) const {
  const auto region = [this](LimitCellId cell) { return solid_->region_of(solid_->control_cell(cell)); };
  return region(touching) == region(*cell_) ? thickness_of(solid_->index().cell_maps[touching]) : 0;
}

/// A channel has other slopes in the next cell, as meshed: they may take it farther, in the shell that was found last,
/// than the piece's error leaves.
bool FaceSurroundings::may_kink(const Piece& piece) {
  double depth_mm = 0;
  for (const BlockShell::Quad& quad : shell_.quads()) {
    depth_mm = std::max(depth_mm, kDeeper * quad.depth * thickness_mm(quad.outwards).norm());
  }
  return !(kink_per_mm(piece, box_of_shell(piece)) * depth_mm <= 1 - piece.error);
}

double FaceSurroundings::reach_as_meshed(const Piece& piece, double columns) {
  collect(piece.cell);
  const Vec3 column_mm = mesh_of_voxel_.linear().col(0);
  for (; columns >= kLeastReach; columns /= 2) {
    Box3 box;
    for (const Vec3& point : piece.points) {
      const Vec3 place = mesh_of_voxel_ * point;
      box.extend(place - columns * column_mm);
      box.extend(place + columns * column_mm);
    }
    if (!goes_on_in(box)) continue;
    // The piece's own error grows to 1 over all of the columns, the more slowly the nearer: no faster than evenly.
    const double left = 1 - piece.error;
    return left / (left / columns + kink_per_mm(piece, box) * column_mm.norm());
  }
  return 0;
}

/// All cells that meet the box (mm of the mesh) touch the one at hand, and none across a gap: the slopes in these cells
/// bound how far a channel gets.
bool FaceSurroundings::goes_on_in(const Box3& box) {
  const CellIndex& index = solid_->index();
  return !index.cell_boxes.any_meeting(box, [&](std::uint32_t met) {
    const LimitCellId other{met};
    if (other == cell_) return false;
    const auto touching = std::ranges::find(touching_, other, &Touching::cell);
    return touching == touching_.end() || is_across_a_gap(*touching);
  });
}

/// How fast a channel may get off beside the piece, as a share of its tolerance, where cells beyond it meet the box (mm
/// of the mesh): between the steepest slopes that it has anywhere in the piece and in them. Infinite where nothing is
/// known of these.
double FaceSurroundings::kink_per_mm(const Piece& piece, const Box3& box) {
  const double voxels_per_mm = voxel_of_mesh_.linear().norm();
  double kink = 0;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double own = bound_of_slopes(piece.polynomials[c], 1).cwiseProduct(piece.frame.scale).norm() * voxels_per_mm;
    for (Touching& touching : touching_) {
      if (!solid_->index().cell_boxes.box(touching.cell).intersects(box)) continue;
      if (touching.thickness_mm == 0) return std::numeric_limits<double>::infinity();
      const double slopes = own + slopes_per_mm(touching)[c];
      if (!std::isfinite(slopes)) return std::numeric_limits<double>::infinity();
      kink = std::max(kink, slopes / channels_[c].tolerance);
    }
  }
  return kink;
}

/// By channel of the spec.
const std::vector<double>& FaceSurroundings::slopes_per_mm(Touching& touching) {
  if (!touching.slopes_per_mm.empty()) return touching.slopes_per_mm;
  if (!inverter_) inverter_.emplace(*solid_, inversion_);
  std::vector<std::array<double, 27>> samples(channels_.size());
  for (std::size_t place = 0; place < 27; ++place) {
    const Vec3 thirds(static_cast<double>(place % 3), static_cast<double>(place / 3 % 3),
                      static_cast<double>(place / 9));
    inverter_->evaluator().mat({touching.cell, 0.5 * thirds}, values_);
    for (std::size_t c = 0; c < channels_.size(); ++c) samples[c][place] = values_[channels_[c].channel];
  }
  const double thickness_mm = thickness_of(solid_->index().cell_maps[touching.cell]);
  for (const std::array<double, 27>& values : samples) {
    touching.slopes_per_mm.push_back(kOblique * steepest_slope(values) / thickness_mm);
  }
  return touching.slopes_per_mm;
}

/// Finds out which cells of those that touch may be met across a gap. False if there are none.
bool FaceSurroundings::find_across_gaps(const Piece& piece, std::size_t side) {
  if (touching_.empty() || !(solid_->boundary_sides(piece.cell) >> side & 1)) return false;
  const Box3 box = box_of_shell(piece);
  const Vec3 outwards =
      (side % 2 != 0 ? 1 : -1) * thickness_mm(piece.shape.inverse_axes.row(static_cast<Eigen::Index>(side / 2)));
  bool any = false;
  for (Touching& touching : touching_) {
    touching.may_be_met = solid_->index().cell_boxes.box(touching.cell).intersects(box) &&
                          looks_back(*solid_, touching.cell, outwards) && is_across_a_gap(touching);
    any = any || touching.may_be_met;
  }
  return any;
}

bool FaceSurroundings::is_across_a_gap(Touching& touching) const {
  if (!touching.is_across_a_gap) {
    std::vector<LimitCellId> around;
    for (const Touching& other : touching_) around.push_back(other.cell);
    touching.is_across_a_gap = ccslice::is_across_a_gap(*solid_, *cell_, touching.cell, around);
  }
  return *touching.is_across_a_gap;
}

bool FaceSurroundings::may_differ(const Piece& piece, std::size_t side) {
  collect(piece.cell);
  const double sure = std::cbrt(1 - piece.error) * sure_share_, sure_mm = sure * least_thickness_mm_;
  if (others_.empty() && touching_.empty()) return false;
  shell_.find(piece.points, piece.shape, side);
  if (shell_.depth() == 0) return false;
  if (proved_ && irregular_ && may_jump_in_patches(piece)) return true;
  if (meets_others(piece)) return true;
  const bool across_gaps = find_across_gaps(piece, side);
  if (solid_->as_meshed()) return across_gaps || may_kink(piece);
  const bool may_jump = across_gaps || least_thickness_mm_ == 0;
  std::optional<CellDistance> distance;  // For each piece anew, as in meets_others().
  return std::ranges::any_of(shell_.places(), [&](const BlockShell::Place& place) {
    const Vec3 outwards = kDeeper * place.depth * thickness_mm(place.outwards);
    const double depth_mm = outwards.norm();
    if (depth_mm <= sure_mm && !across_gaps) return false;
    if (proved_) return true;
    const auto differs = [&](const Vec3& point) {
      const std::optional<CellParam> there = guess_beyond(point, depth_mm / sure, across_gaps, distance);
      return there && differs_at(piece, point, *there);
    };
    const Vec3 edge = mesh_of_voxel_ * place.voxel;
    // Where a cell is met across an edge alone, the place beyond the triangle's edge may lie behind that cell.
    return differs(edge + (kDeeper - 1) / kDeeper * outwards) || (may_jump && differs(edge));
  });
}

bool FaceSurroundings::reaches_into_patches(const Piece& piece, std::size_t side) {
  if (solid_->cell_class(piece.cell) == CellClass::kRegular) return false;
  shell_.find(piece.points, piece.shape, side);
  return may_jump_in_patches(piece);
}

/// Third derivatives of the next patch may come to too much in the shell that was found last. A piece is no thicker
/// than its own patch.
bool FaceSurroundings::may_jump_in_patches(const Piece& piece) const {
  return kDeeper * shell_.depth() > kThinnestPatch * std::cbrt(1 - piece.error) * sure_share_;
}

bool FaceSurroundings::reaches_into_air(const Piece& piece, std::size_t side) {
  const unsigned at_boundary = neighbours_at_edges(side, solid_->boundary_edges(piece.cell)) & piece.own_sides;
  if (at_boundary == 0) return false;
  shell_.find(piece.points, piece.shape, side);
  return std::ranges::any_of(shell_.places(), [&](const BlockShell::Place& place) {
    return (place.sides & at_boundary) != 0 && place.depth * thickness_mm(place.outwards).norm() > kOffCell;
  });
}

/// The shortest way across a share of 1, mm of the mesh. `outwards`: of a place in the shell.
Vec3 FaceSurroundings::thickness_mm(const Eigen::RowVector3d& outwards) const {
  const Vec3 per_mm = (outwards * voxel_of_mesh_.linear()).transpose();
  return per_mm / per_mm.squaredNorm();
}

/// Holds the shell of the side that was found last, kDeeper times as deep. mm of the mesh.
Box3 FaceSurroundings::box_of_shell(const Piece& piece) const {
  Box3 box;
  for (const BlockShell::Quad& quad : shell_.quads()) {
    const Vec3 depth = (kDeeper * quad.depth * thickness_mm(quad.outwards)).cwiseAbs();
    for (const std::size_t corner : quad.corners) {
      const Vec3 place = mesh_of_voxel_ * piece.points[corner];
      box.extend(place - depth);
      box.extend(place + depth);
    }
  }
  return box;
}

/// The shell may meet a cell that doesn't touch the piece's.
bool FaceSurroundings::meets_others(const Piece& piece) const {
  if (others_.empty()) return false;
  const Box3 box = box_of_shell(piece);
  const auto is_near = [&](LimitCellId other) { return solid_->index().cell_boxes.box(other).intersects(box); };
  if (std::ranges::none_of(others_, is_near)) return false;
  struct Part {
    std::array<Vec3, 4> corners;
    Vec3 depth;
  };
  std::vector<Part> parts;
  for (const BlockShell::Quad& quad : shell_.quads()) {
    Part& part = parts.emplace_back();
    part.depth = kDeeper * quad.depth * thickness_mm(quad.outwards);
    for (std::size_t k = 0; k < 4; ++k) part.corners[k] = mesh_of_voxel_ * piece.points[quad.corners[k]];
  }
  // What it learns of a cell makes its later answers closer. They mustn't depend on earlier pieces.
  std::optional<CellDistance> distance;
  return std::ranges::any_of(others_, [&](LimitCellId other) {
    return is_near(other) && std::ranges::any_of(parts, [&](const Part& part) {
             return meets(other, part.corners, part.depth, kMostQuarterings, distance);
           });
  });
}

/// A part of the shell may meet a cell: a quadrilateral, and so far before it. In the parameters that the cell's map
/// guesses, where the cell is nearly a cube, boxes are compared. Bent cells are looked at more closely, and quarters of
/// the part.
bool FaceSurroundings::meets(LimitCellId other, const std::array<Vec3, 4>& corners, const Vec3& depth, int quarterings,
                             std::optional<CellDistance>& distance) const {
  const CellMap map = solid_->index().cell_maps[other];
  Box3 box, guesses;
  for (const Vec3& corner : corners) {
    box.extend(corner);
    guesses.extend(map(corner));
  }
  const Vec3 margin = (map.inverse_jacobian * depth).cwiseAbs() + Vec3::Constant(kRoundingOfGuess);
  if (!Box3(guesses.min() - margin, guesses.max() + margin).intersects(map.hull)) return false;
  if (!distance) distance.emplace(*solid_);
  if (distance->exceeds(other, box.center(), 0.5 * box.diagonal().norm() + depth.norm())) return false;
  if (quarterings == 0) return true;
  const auto& [a, b, c, d] = corners;
  const Vec3 ab = 0.5 * (a + b), ac = 0.5 * (a + c), bd = 0.5 * (b + d), cd = 0.5 * (c + d);
  const Vec3 middle = 0.5 * (a + d);  // Of the edge that the triangles share: where it is cut, the quarters hold them.
  const auto quarter = [&](const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s) {
    return meets(other, {p, q, r, s}, depth, quarterings - 1, distance);
  };
  return quarter(a, ab, ac, middle) || quarter(ab, b, middle, bd) || quarter(ac, middle, c, cd) ||
         quarter(middle, bd, cd, d);
}

/// About the parameter of a point in a cell that touches the piece's and is thinner than `thickness_mm`, or with
/// `across_gaps` in one that may be met across a gap. Nothing if there is none.
std::optional<CellParam> FaceSurroundings::guess_beyond(const Vec3& point, double thickness_mm, bool across_gaps,
                                                        std::optional<CellDistance>& distance) const {
  std::optional<CellParam> nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  for (const Touching& touching : touching_) {
    const bool is_thin = thickness_mm > touching.thickness_mm;
    const bool may_be_met = across_gaps && touching.may_be_met;
    if (!is_thin && !(may_be_met && solid_->index().cell_boxes.box(touching.cell).contains(point))) continue;
    const CellMap map = solid_->index().cell_maps[touching.cell];
    const Vec3 guess = map(point);
    if (!map.may_hold(guess, 0)) continue;
    const double from_middle = (guess - Vec3::Constant(0.5)).lpNorm<Eigen::Infinity>();
    if (from_middle >= nearest_distance) continue;
    if (!is_thin) {
      if (!distance) distance.emplace(*solid_);
      if (distance->exceeds(touching.cell, point, kOffCell)) continue;
    }
    nearest_distance = from_middle;
    nearest = CellParam{touching.cell, guess.cwiseMax(0).cwiseMin(1)};
  }
  return nearest;
}

bool FaceSurroundings::differs_at(const Piece& piece, const Vec3& point, const CellParam& hint) {
  if (!inverter_) inverter_.emplace(*solid_, inversion_);
  const auto found = inverter_->invert(point, hint);
  if (!found || found->at.cell == piece.cell) return false;
  inverter_->evaluator().mat(found->at, values_);
  const Vec3 at = piece.frame(voxel_of_mesh_ * point);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double error = values_[channels_[c].channel] - value_at(piece.polynomials[c], at);
    if (!(std::abs(error) <= kPieceShare * channels_[c].tolerance)) return true;
  }
  return false;
}

}  // namespace ccslice
