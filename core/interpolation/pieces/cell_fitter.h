// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A cell is cut into a tree of boxes of its parameters, NODES, over each of which a cubic polynomial of the voxel
// stands for a channel.
//
// A node is sampled forward (interpolation/samples/cell_block.h): positions and channels at 5 x 5 x 5 parameters, no
// inversion. A cubic of the position is fitted to every other sample (interpolation/fits/block_fitter.h). Where the
// node lies in one regular patch (interpolation/fits/block_bound.h), or in a line cell
// (interpolation/fits/residual_bound.h), its error is bounded over all of it. In vertex cells it is judged at all
// samples, and at others between them, since five equidistant ones don't show errors of the fifth degree. If the error
// is above its share of the tolerance, or the faces bulge too much to be told from flat triangles, the node is halved
// along the fewest axes that seem enough, and so on. The map from parameters to points is smooth even where its inverse
// isn't, beside irregular lines, and nodes end where cells do; so they are far larger than boxes of voxels would be.
//
// If all is to be proved (InterpolationSpec::proved), vertex cells are halved until their nodes lie in one patch or
// beside a line, but for holes at the vertex. A piece then paints nothing outside of its triangles, nor in shells so
// deep that what lies there would have to be sampled.
//
// Just outside of what it is fitted to a cubic's errors grow fast. A node's voxels are told by flat triangles, which
// miss its faces by their bulge, so the fit has to be better where faces bulge more. And voxels that the contours'
// tolerance puts inside take what the boundary has, so where materials are steep at the boundary a node knows what is
// beyond it. So it does where the triangles reach into other cells whose materials may be others
// (interpolation/pieces/face_surroundings.h).
//
// A node whose pieces would take longer than inverting its voxels isn't halved: it is left out, and so is all that lies
// near folds and overlaps. These nodes are HOLES. How many voxels its pieces would have is told by its error, which
// falls with the fourth power of the size. So a tolerance that is too strict for pieces costs one node a cell.
//
// Nodes depend on the solid, the spec and the cell alone, whoever asks for them, in whatever order.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/interpolation/fits/block_bound.h"
#include "core/interpolation/fits/block_fitter.h"
#include "core/interpolation/fits/residual_bound.h"
#include "core/interpolation/pieces/block_shape.h"
#include "core/interpolation/pieces/face_surroundings.h"
#include "core/interpolation/samples/block_nodes.h"
#include "core/interpolation/samples/cell_block.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// A cell's parameters about the middle of one of its nodes, to first order.
struct ParameterMap {
  Vec3 voxel = Vec3::Zero();  // The middle.
  Vec3 uvw = Vec3::Zero();    // Parameters of the middle.
  Mat3 slope = Mat3::Zero();

  /// About the parameter of a place, clipped to the cell.
  Vec3 operator()(const Vec3& at) const { return (uvw + slope * (at - voxel)).cwiseMax(0).cwiseMin(1); }
};

/// What a node of kind kPiece holds: its polynomials.
struct CellPiece {
  VoxelFrame frame;
  ParameterMap parameters;
  std::vector<CubicPolynomial> polynomials;  // One a channel.
  double error = 0;                          // At most, as a share of each channel's tolerance.
  double reach = 0;                          // Columns that the polynomials may be followed beyond the piece.
  bool at_boundary = false;                  // A side of it is on the boundary.
  BlockPoints points;                        // Voxels,
  std::size_t step;                          // BlockShape::step.
  std::vector<CubicPolynomial> beyond;       // One for each of the cell's faces beyond which the piece mustn't paint:
                                             // positive outside of the face, and just inside.
};

/// A box of a cell's parameters.
struct CellNode {
  enum class Kind : std::uint8_t { kUnknown, kPiece, kHole, kHalved };

  ParamBox parameters;
  Box3 bounds;  // Voxels: hold the node. By its parent's samples; from examine() on by its own, too.
  Kind kind = Kind::kUnknown;
  std::uint32_t first_child = 0, end_child = 0;  // kHalved.
  std::shared_ptr<const CellPiece> piece;        // kPiece.
  std::shared_ptr<const ParameterMap> map;       // kHole, unless it is ambiguous or flat: a parameter near.
};

/// One thread.
class CellFitter {
 public:
  /// `blocks`: of the solid and the spec, or its own. REQUIRES: all tolerances positive.
  CellFitter(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
             std::shared_ptr<VoxelBlocks> blocks = nullptr);

  /// Makes the node a piece or a hole, or appends what it is halved into. REQUIRES: its kind is kUnknown; `nodes` are
  /// of this cell.
  void examine(LimitCellId cell, std::vector<CellNode>& nodes, std::uint32_t node);

 private:
  /// What is known of errors between a node's samples.
  enum class Between : std::uint8_t { kOnePatch, kResiduals, kNothing };

  void sample(LimitCellId cell, const ParamBox& box);
  unsigned fit_or_split(LimitCellId cell, const BlockShape& shape, CellNode& node);
  bool is_worth_halving(Between between, const BlockShape& shape, double predicted) const;
  unsigned leave(const BlockShape& shape, CellNode& node) const;
  [[nodiscard]] std::shared_ptr<const CellPiece> make_piece(LimitCellId cell, const BlockShape& shape,
                                                            const ParamBox& box, const VoxelFrame& frame, double error);
  ParameterMap parameters_of(const BlockShape& shape, const ParamBox& box) const;
  Between what_is_known_between(LimitCellId cell, const ParamBox& box) const;
  unsigned axes_to_halve(const BlockShape& shape, double error, double growth) const;
  double fit(LimitCellId cell, const ParamBox& box, const VoxelFrame& frame, Between between, double beyond);
  bool place_residuals(LimitCellId cell, const ParamBox& box, const VoxelFrame& frame, double beyond);
  double with_residuals(std::size_t channel, double error, double allowed);
  Vec3 errors_between_nodes(LimitCellId cell, const ParamBox& box, const VoxelFrame& frame);
  bool is_steep_at(const VoxelFrame& frame, std::size_t axis, bool high, double error) const;
  bool may_be_steep_near(const VoxelFrame& frame, double error) const;
  CubicPolynomial fit_beyond(std::size_t axis, bool high);
  double margin_of_share(const CubicPolynomial& share, double error);
  void append_halves(std::vector<CellNode>& nodes, std::uint32_t node, unsigned axes) const;
  Box3 bounds_of_half(unsigned child, unsigned axes) const;

  std::shared_ptr<const LimitSolid> solid_;
  const Placement mesh_of_voxel_;
  const Vec3 pitch_mm_;
  const double outside_mm_;
  const bool proved_;
  const std::vector<ChannelTolerance> channels_;
  std::shared_ptr<VoxelBlocks> blocks_;
  FaceSurroundings surroundings_;

  // The node at hand.
  BlockPlacesInVoxels places_;
  std::vector<BlockValues> values_;
  BlockPoints points_;
  BlockFitter fitter_;
  BlockBound bound_;
  BlockResiduals residuals_;
  ResidualBound residual_bound_;
  bool residuals_known_ = false;   // As far as they were needed: of all pieces beside lines.
  double residual_growth_ = 1;     // How residuals may grow around the node.
  bool off_by_residuals_ = false;  // They take most of the error.
  std::vector<CubicPolynomial> polynomials_;
};

}  // namespace ccslice
