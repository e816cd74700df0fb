// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/cell_fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "core/interpolation/fits/shares.h"
#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

// A piece takes some 15 us, from the nodes on the way to it to its runs, and 6 us for each channel. Inverting a node in
// one patch takes some 1.5 us for each row that crosses it, however many voxels that has. In other nodes most halves
// fit far sooner than those at the irregular line or vertex.
constexpr double kPieceUs = 15, kChannelOfPieceUs = 6, kInvertedRowUs = 1.5;
constexpr double kSmallestHalved = 64;       // Nodes of fewer voxels aren't halved any more.
constexpr double kSmallestPredicted = 16;    // Nor are those in several patches whose pieces would have fewer.
constexpr double kSmallestAmbiguous = 2048;  // Nodes of fewer that may fold aren't either.
constexpr double kMostRowsOfPiece = 1024;    // A piece spans at most so many rows.
constexpr double kMostReach = 8;             // A piece may be followed by so many columns at most.
constexpr double kMarginOfNode =
    0.06;  // As a share of a node's size: how far its faces may reach beyond its samples' box.
constexpr double kMarginOfHalf = 0.2;  // How far a half's faces may reach beyond its parent's samples' box.

constexpr double kLikeTheWorst = 0.6;  // Axes along which errors are at least this share of the largest are halved.

/// How many times errors of cubics grow at this share of the thickness beyond what they were fitted to: like the fourth
/// Chebyshev polynomial T_4(x) = 8 x^4 - 8 x^2 + 1 at x = 1 + 2 share. What a good cubic leaves of a smooth function is
/// mostly of degree 4, and of all such polynomials that stay below 1 on [-1, 1] this one grows fastest outside.
double growth_beyond(double share) {
  const double square = (1 + 2 * share) * (1 + 2 * share);
  return 8 * square * (square - 1) + 1;
}

/// The share of the thickness beyond which errors have grown so many times: growth_beyond() solved for the share.
double share_of_growth(double growth) { return 0.5 * (std::sqrt(0.5 + 0.5 * std::sqrt(0.5 + 0.5 * growth)) - 1); }

/// Sides of a box that are on its cell's, a bit each: 2 * axis + (at its end).
unsigned own_sides_of(const ParamBox& box) {
  unsigned sides = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (box.low[axis] == 0) sides |= 1u << (2 * axis);
    if (box.high[axis] == 1) sides |= 1u << (2 * axis + 1);
  }
  return sides;
}

/// Bit a if the a-th of the numbers is above this share of the largest.
unsigned largest_axes(const Vec3& numbers, double share) {
  unsigned axes = 0;
  for (int a = 0; a < 3; ++a) {
    if (numbers[a] > share * numbers.maxCoeff()) axes |= 1u << a;
  }
  return axes;
}

}  // namespace

CellFitter::CellFitter(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                       std::shared_ptr<VoxelBlocks> blocks)
    : solid_(std::move(solid)),
      mesh_of_voxel_(voxel_of_mesh(spec.placement, spec.grid).inverse(Eigen::Affine)),
      pitch_mm_(spec.grid.pitch.x_mm, spec.grid.pitch.y_mm, spec.grid.pitch.z_mm),
      outside_mm_(spec.outside_mm),
      proved_(spec.proved),
      channels_(spec.channels),
      blocks_(blocks ? std::move(blocks) : std::make_shared<VoxelBlocks>(*solid_, spec)),
      surroundings_(solid_, spec) {}

void CellFitter::examine(LimitCellId cell, std::vector<CellNode>& nodes, std::uint32_t node) {
  sample(cell, nodes[node].parameters);
  const BlockShape shape = shape_of(points_);
  CellNode examined = nodes[node];
  examined.bounds = examined.bounds.intersection(grown(shape.box, kMarginOfNode));
  const unsigned axes = fit_or_split(cell, shape, examined);
  nodes[node] = std::move(examined);
  if (axes != 0) append_halves(nodes, node, axes);
}

/// Fills places_ and values_, and the points.
void CellFitter::sample(LimitCellId cell, const ParamBox& box) {
  blocks_->sample(cell, box, places_, values_);
  for (std::size_t n = 0; n < points_.size(); ++n) points_[n] = at_slot(places_, block_slot(n));
}

/// Makes a piece of the node, or a hole. Or else returns the axes to halve it along.
unsigned CellFitter::fit_or_split(LimitCellId cell, const BlockShape& shape, CellNode& node) {
  node.kind = CellNode::Kind::kHole;
  const Box3 around = grown(shape.box, kMarginOfNode);
  if (solid_->index().is_ambiguous(around.transformed(mesh_of_voxel_))) {
    return shape.voxels > kSmallestAmbiguous ? kAllAxes : 0;
  }
  if (shape.flat) return 0;
  if (shape.box.diagonal().y() > kMostRowsOfPiece) return kAllAxes;
  const Between between = what_is_known_between(cell, node.parameters);
  const bool bounded = between != Between::kNothing;
  if (proved_ && !bounded) return shape.voxels < kSmallestHalved ? leave(shape, node) : kAllAxes;
  const VoxelFrame frame = VoxelFrame::of(shape.box.min(), shape.box.max());
  // What samples' errors grow to. Along the triangles' sides their share is to hold, and all of the tolerance where
  // triangles are farthest off.
  const double at_sides = growth_beyond(shape.bulge.maxCoeff());
  const double farthest = kSampledPieceShare * growth_beyond(shape.miss);
  const double growth = std::max(at_sides, farthest);
  double error = fit(cell, node.parameters, frame, between, shape.miss);
  double of_tolerance = kPieceShare * error;
  if (!bounded) {  // A bound holds that far off already.
    of_tolerance = std::max(kBetweenSamplesShare * at_sides, farthest) * error;
    error *= growth;
  }
  unsigned axes = 0;
  if (error <= 1 && shape.bent_axes() == 0) {
    if (!bounded) {
      const Vec3 between_nodes = errors_between_nodes(cell, node.parameters, frame);
      const double worst = between_nodes.maxCoeff();
      of_tolerance = std::max(of_tolerance, worst / kSeenBetweenSamples);
      if (!(worst <= kBetweenSamplesShare)) {
        axes = std::isfinite(worst) ? largest_axes(between_nodes, kLikeTheWorst) : kAllAxes;
      }
    }
    if (axes == 0) {
      node.kind = CellNode::Kind::kPiece;
      node.piece = make_piece(cell, shape, node.parameters, frame, of_tolerance);
      return 0;
    }
  }
  // Errors of cubics fall with the fourth power of the size, so voxels of pieces with the third of its root.
  const double predicted = shape.voxels / std::max(1.0, std::pow(error, 0.75));
  if (!is_worth_halving(between, shape, predicted)) return leave(shape, node);
  return axes != 0 ? axes : axes_to_halve(shape, error, growth);
}

/// `predicted`: voxels that its pieces would have.
bool CellFitter::is_worth_halving(Between between, const BlockShape& shape, double predicted) const {
  if (shape.voxels < kSmallestHalved) return false;
  if (between != Between::kOnePatch) return predicted >= kSmallestPredicted;
  const double inverted_rows = predicted / std::max(1.0, shape.thickness_along_x());
  return kInvertedRowUs * inverted_rows >= kPieceUs + kChannelOfPieceUs * static_cast<double>(channels_.size());
}

/// Makes a hole of the node whose voxels are inverted. It is halved along no axis.
unsigned CellFitter::leave(const BlockShape& shape, CellNode& node) const {
  node.map = std::make_shared<const ParameterMap>(parameters_of(shape, node.parameters));
  return 0;
}

CellFitter::Between CellFitter::what_is_known_between(LimitCellId cell, const ParamBox& box) const {
  if (blocks_->is_in_one_patch(cell, box)) return Between::kOnePatch;
  const bool beside_line = proved_ ? blocks_->is_beside_line(cell, box) : solid_->cell_class(cell) == CellClass::kLine;
  return beside_line ? Between::kResiduals : Between::kNothing;
}

/// Makes a piece of polynomials_, which fit. They may be followed as long as their errors stay within the tolerance.
std::shared_ptr<const CellPiece> CellFitter::make_piece(LimitCellId cell, const BlockShape& shape, const ParamBox& box,
                                                        const VoxelFrame& frame, double error) {
  // The error is what it may have grown to as far off as the triangles miss the faces. It reaches the tolerance where
  // it has grown 1 / error times since then, so growth_beyond(miss) / error times since the faces.
  const double beyond =
      std::clamp(share_of_growth(growth_beyond(shape.miss) / error) - shape.miss, 0.0, kMostReachShare);
  const double reach = proved_ ? 0 : std::min(beyond * shape.thickness_along_x(), kMostReach);
  CellPiece piece{frame, parameters_of(shape, box), polynomials_, error, reach, false, points_, shape.step, {}};
  const unsigned boundary_sides = solid_->boundary_sides(cell), interface_sides = solid_->interface_sides(cell);
  const unsigned own_sides = own_sides_of(box);
  const FaceSurroundings::Piece in_cell{cell, points_, shape, frame, polynomials_, error, own_sides};
  if (solid_->as_meshed()) piece.reach = surroundings_.reach_as_meshed(in_cell, reach);
  for (std::size_t side = 0; side < 6; ++side) {
    if (!(own_sides >> side & 1)) {
      if (proved_ && surroundings_.reaches_into_patches(in_cell, side)) {
        piece.beyond.push_back(fit_beyond(side / 2, side % 2 != 0));
      }
      continue;
    }
    const bool at_boundary = boundary_sides >> side & 1;
    piece.at_boundary = piece.at_boundary || at_boundary;
    const auto is_steep = [&] {
      return proved_ ? may_be_steep_near(frame, error) : is_steep_at(frame, side / 2, side % 2 != 0, error);
    };
    // Beyond an interface is another region, whose material need not go on from this one's.
    if (interface_sides >> side & 1 || (at_boundary && is_steep()) || surroundings_.may_differ(in_cell, side) ||
        (!at_boundary && surroundings_.reaches_into_air(in_cell, side) && is_steep())) {
      piece.beyond.push_back(fit_beyond(side / 2, side % 2 != 0));
    }
  }
  return std::make_shared<const CellPiece>(std::move(piece));
}

/// Following the polynomials as far outside as voxels may lie may change a channel by what pieces' errors leave of its
/// tolerance.
bool CellFitter::is_steep_at(const VoxelFrame& frame, std::size_t axis, bool high, double error) const {
  const Vec3 scale = frame.scale.cwiseQuotient(pitch_mm_);
  const std::size_t s_stride = kBlockStride[(axis + 1) % 3], t_stride = kBlockStride[(axis + 2) % 3];
  const std::size_t first = high ? (kBlockNodes - 1) * kBlockStride[axis] : 0;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double most = (1 - error) * channels_[c].tolerance / outside_mm_;
    for (std::size_t t = 0; t < kBlockNodes; t += 2) {
      for (std::size_t s = 0; s < kBlockNodes; s += 2) {
        const Vec3 place = frame(points_[first + s * s_stride + t * t_stride]);
        if (!(gradient_at(polynomials_[c], place).cwiseProduct(scale).norm() <= most)) return true;
      }
    }
  }
  return false;
}

/// The same, anywhere in or beside the piece.
bool CellFitter::may_be_steep_near(const VoxelFrame& frame, double error) const {
  const Vec3 scale = frame.scale.cwiseQuotient(pitch_mm_);
  const double most = 1 + 2 * kMarginOfNode + scale.maxCoeff() * outside_mm_;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double slope = bound_of_slopes(polynomials_[c], most).cwiseProduct(scale).norm();
    if (!(slope * outside_mm_ <= (1 - error) * channels_[c].tolerance)) return true;
  }
  return false;
}

/// How far polynomials_ are off between the nodes along each axis, as shares of the tolerance. Overwrites places_ and
/// values_. REQUIRES: they fit.
Vec3 CellFitter::errors_between_nodes(LimitCellId cell, const ParamBox& box, const VoxelFrame& frame) {
  blocks_->sample_between_nodes(cell, box, places_, values_);
  enter_frame(frame, kGroupsBetweenNodes, places_);
  Vec3 errors = Vec3::Zero();
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    for (std::size_t g = 0; g < kGroupsBetweenNodes; ++g) {
      const Lanes error = values_[c][g] - values_at(polynomials_[c], places_[0][g], places_[1][g], places_[2][g]);
      const double worst = largest(error < 0 ? -error : error) / channels_[c].tolerance;
      if (!std::isfinite(worst)) return Vec3::Constant(std::numeric_limits<double>::infinity());
      for (std::size_t a = 0; a < 3; ++a) {
        if (!is_between_nodes_along(a, g)) continue;
        double& known = errors[static_cast<Eigen::Index>(a)];
        known = std::max(known, worst);
      }
    }
  }
  return errors;
}

/// Positive beyond the face, and as far before it as the fit may be off: a cubic of the voxel is fitted to the share of
/// the node's axis, 0 to 1, and stands for its inverse map. If it is off by as much as that, no voxel of it is sure.
/// REQUIRES: fit() was called.
CubicPolynomial CellFitter::fit_beyond(std::size_t axis, bool high) {
  constexpr double kLeast = 1e-6;
  CubicPolynomial share;
  const double error = fitter_.fit(block_shares()[axis], share), margin = margin_of_share(share, error) + kLeast;
  if (!(margin < 1)) return {1};
  if (high) {
    share[0] -= 1;
  } else {
    for (double& coefficient : share) coefficient = -coefficient;
  }
  share[0] += margin;
  return share;
}

/// How far the cubic that stands for a share may be off in the node. `error`: at the nodes. If all is to be proved, a
/// bound, if that is below 1; beside a line, of what interpolation leaves out too: the share itself has no residuals.
/// REQUIRES: that cubic was fitted last.
double CellFitter::margin_of_share(const CubicPolynomial& share, double error) {
  constexpr double kOff = 3, kLeast = 1e-6, kAll = 1;
  if (!proved_) return kOff * error;
  // What comes near `enough` is close; what exceeds it needn't be a bound.
  double enough = std::clamp(kOff * error, kLeast, kAll), margin = bound_(share, fitter_.errors(), enough);
  while (!(margin <= enough) && enough < kAll) {
    enough = std::min(2 * enough, kAll);
    margin = bound_(share, fitter_.errors(), enough);
  }
  if (residuals_known_) {
    const std::vector<BlockResiduals::AlongLine> none(residuals_.planar->count());
    margin += residual_growth_ * residual_bound_(share, none, kAll);
  }
  return margin;
}

ParameterMap CellFitter::parameters_of(const BlockShape& shape, const ParamBox& box) const {
  const Vec3 size = box.high - box.low;
  return {points_[points_.size() / 2], box.low + 0.5 * size, size.asDiagonal() * shape.inverse_axes};
}

/// Halving along one axis is enough where little is missing. `error`: with `growth`, without which it may be small
/// enough.
unsigned CellFitter::axes_to_halve(const BlockShape& shape, double error, double growth) const {
  unsigned axes = shape.bent_axes();
  if (error <= 1) return axes;
  if (error <= growth) return axes | largest_axes(shape.bulge, kLikeTheWorst);
  // Along the line there are no residuals: halving across it is what makes them smaller.
  if (off_by_residuals_) return axes | 1u << residuals_.box.axis[0] | 1u << residuals_.box.axis[1];
  return axes | fitter_.axes_to_halve(error);
}

/// Fills polynomials_. Returns the error as a share of what is allowed, of the first channel that is beyond it: a bound
/// where there is one, beyond the node too.
double CellFitter::fit(LimitCellId cell, const ParamBox& box, const VoxelFrame& frame, Between between, double beyond) {
  enter_frame(frame, kBlockGroups, places_);
  fitter_.factorize(places_);
  const bool bounded = between != Between::kNothing;
  if (bounded) {
    bound_.set_places(places_, beyond, between == Between::kOnePatch ? PlaceDegree::kThree : PlaceDegree::kFour);
  }
  off_by_residuals_ = residuals_known_ = false;
  polynomials_.clear();
  double worst = 0;
  for (std::size_t c = 0; c < channels_.size() && worst <= 1; ++c) {
    polynomials_.emplace_back();
    const double allowed = (bounded ? kPieceShare : kSampledPieceShare) * channels_[c].tolerance;
    double error = fitter_.fit(values_[c], polynomials_.back());
    if (bounded && error <= allowed) error = bound_(polynomials_.back(), fitter_.errors(), allowed);
    if (between == Between::kResiduals && error <= allowed) {
      residuals_known_ = residuals_known_ || place_residuals(cell, box, frame, beyond);
      error = residuals_known_ ? with_residuals(c, error, allowed) : std::numeric_limits<double>::infinity();
    }
    worst = std::max(error / allowed, worst);  // Not a number stays that.
  }
  return worst;
}

/// REQUIRES: a node beside a line, its places in the frame. False if it is too thin.
bool CellFitter::place_residuals(LimitCellId cell, const ParamBox& box, const VoxelFrame& frame, double beyond) {
  if (!blocks_->find_residuals(cell, box, residuals_)) return false;
  residual_bound_.set_block(places_, residuals_, frame.scale.asDiagonal() * mesh_of_voxel_.linear().inverse());
  residual_growth_ = growth_beyond(beyond);
  return true;
}

/// Adds the residuals' bound to the last fit's. Beyond the node they are taken to grow as errors of cubics do.
double CellFitter::with_residuals(std::size_t channel, double error, double allowed) {
  const double residuals =
      residual_growth_ * residual_bound_(polynomials_.back(), residuals_.values[channel], allowed / residual_growth_);
  const double left = allowed - residuals;
  // A bound that was near enough for all of `allowed` may be a loose one. With less left it is looked for anew.
  if (error > left && left > 0) error = bound_(polynomials_.back(), fitter_.errors(), left);
  off_by_residuals_ = residuals > error;
  return error + residuals;
}

void CellFitter::append_halves(std::vector<CellNode>& nodes, std::uint32_t node, unsigned axes) const {
  const auto first = static_cast<std::uint32_t>(nodes.size());
  const ParamBox whole = nodes[node].parameters;
  const Box3 bounds = nodes[node].bounds;
  for (unsigned child = 0; child < 8; ++child) {
    if (child & ~axes) continue;
    CellNode& half = nodes.emplace_back();
    half.parameters = whole;
    for (int a = 0; a < 3; ++a) {
      if (!(axes >> a & 1)) continue;
      (child >> a & 1 ? half.parameters.low : half.parameters.high)[a] = 0.5 * (whole.low[a] + whole.high[a]);
    }
    half.bounds = bounds.intersection(bounds_of_half(child, axes));
  }
  nodes[node].kind = CellNode::Kind::kHalved;
  nodes[node].first_child = first;
  nodes[node].end_child = static_cast<std::uint32_t>(nodes.size());
}

/// A box around a half, by those of the samples at hand that are its own, too.
Box3 CellFitter::bounds_of_half(unsigned child, unsigned axes) const {
  constexpr std::size_t kMiddle = kBlockNodes / 2;
  std::array<std::size_t, 3> first, end;
  for (std::size_t a = 0; a < 3; ++a) {
    const bool halved = axes >> a & 1, upper = child >> a & 1;
    first[a] = halved && upper ? kMiddle : 0;
    end[a] = halved && !upper ? kMiddle + 1 : kBlockNodes;
  }
  Box3 box;
  for (std::size_t k = first[2]; k < end[2]; ++k) {
    for (std::size_t j = first[1]; j < end[1]; ++j) {
      const std::size_t row = j * kBlockStride[1] + k * kBlockStride[2];
      for (std::size_t i = first[0]; i < end[0]; ++i) box.extend(points_[row + i * kBlockStride[0]]);
    }
  }
  return grown(box, kMarginOfHalf);
}

}  // namespace ccslice
