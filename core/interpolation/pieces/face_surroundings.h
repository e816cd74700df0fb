// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What may lie beyond a face: whether a piece's polynomials hold in the shell of one of its faces.
//
// A piece paints what is inside its flat triangles, and where these are outside of the cell's face
// (interpolation/pieces/block_shell.h) that is another cell's, or nothing. Three kinds of cells may be met there:
//
// - Cells that TOUCH the piece's own, by control cells that share a vertex, and whose material goes on from it with two
//   continuous derivatives. Only the third ones jump: by 8 times a channel's range at most a parameter of the cell
//   beyond, as third differences of control values are within 4 times. At the depth s of that cell's thickness that is
//   8 s^3 / 6 of the range. (In a solid that is as meshed slopes jump at every face, which counts instead, by the
//   steepest on either side; nothing is inverted.) While it is less than what a piece's bound leaves of the tolerance,
//   nothing need be known.
//   Deeper shells are looked at, and all where such a cell is of another cell region, or across a gap that ends in an
//   edge or a vertex of both (limit/cell_gaps.h) and has a face of the boundary that looks back: the deepest places are
//   inverted, and in these two cases those on the triangles themselves, and what lies there is compared with the
//   polynomials. If all is to be proved (InterpolationSpec::proved), nothing is inverted: wherever it would be, values
//   may differ. So they may beside irregular cells where the shell is so deep that a jump in one of their patches,
//   which are smaller, comes to more than is left.
// - Other cells behind those, and cells across a slit or a gap: what they hold has nothing to do with this piece.
//   If one of them may reach into the shell, the polynomials don't hold there.
// - None. Nobody asks for voxels there, but for those within the contours' tolerance of the solid: where materials are
//   so steep that it matters, triangles mustn't reach beyond an edge on the boundary.
//
// An answer depends on the solid, the spec and the piece alone.

#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/interpolation/pieces/block_shape.h"
#include "core/interpolation/pieces/block_shell.h"
#include "core/interpolation/samples/block_nodes.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/inversion/point_inverter.h"
#include "core/limit/cell_distance.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// One thread.
class FaceSurroundings {
 public:
  FaceSurroundings(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec);

  /// A piece of a cell: its nodes, in voxels, and one polynomial a channel.
  struct Piece {
    LimitCellId cell;
    const BlockPoints& points;
    const BlockShape& shape;
    const VoxelFrame& frame;
    std::span<const CubicPolynomial> polynomials;
    double error;        // Its bound's, as a share of the tolerance. < 1.
    unsigned own_sides;  // Bit s: its side s is on the cell's.
  };

  /// Somewhere beyond a side of the piece, inside its triangles, a voxel's value may be off by more than the tolerance.
  /// REQUIRES: the side is on the cell's own (LimitSolid::boundary_sides()), and the piece isn't flat.
  bool may_differ(const Piece& piece, std::size_t side);
  /// Somewhere beyond a side of the piece that isn't on the cell's, inside its triangles, what the next patch's third
  /// derivatives change of a value may come to more than the tolerance. REQUIRES: the piece isn't flat.
  bool reaches_into_patches(const Piece& piece, std::size_t side);
  /// Its triangles reach beyond the side at an edge of the cell on the boundary. There may be nothing there, and voxels
  /// off the solid are to have what the boundary has. REQUIRES: as may_differ().
  bool reaches_into_air(const Piece& piece, std::size_t side);
  /// How many columns the piece may be followed as meshed, where slopes jump between cells: no farther than into those
  /// that touch its own. `columns`: for how many its polynomials hold.
  double reach_as_meshed(const Piece& piece, double columns);

 private:
  /// A cell that touches the one at hand.
  struct Touching {
    LimitCellId cell;
    double thickness_mm;                       // 0 of another cell region.
    std::optional<bool> is_across_a_gap = {};  // Once it is known.
    bool may_be_met = false;                   // By the last side's shell, across a gap.
    std::vector<double> slopes_per_mm = {};    // As meshed: the steepest of each channel there, once they are known.
  };

  void collect(LimitCellId cell);
  double least_thickness_mm(LimitCellId touching) const;
  bool may_jump_in_patches(const Piece& piece) const;
  bool may_kink(const Piece& piece);
  bool goes_on_in(const Box3& box);
  double kink_per_mm(const Piece& piece, const Box3& box);
  const std::vector<double>& slopes_per_mm(Touching& touching);
  bool find_across_gaps(const Piece& piece, std::size_t side);
  bool is_across_a_gap(Touching& touching) const;
  Vec3 thickness_mm(const Eigen::RowVector3d& outwards) const;
  Box3 box_of_shell(const Piece& piece) const;
  bool meets_others(const Piece& piece) const;
  bool meets(LimitCellId other, const std::array<Vec3, 4>& corners, const Vec3& depth, int quarterings,
             std::optional<CellDistance>& distance) const;
  std::optional<CellParam> guess_beyond(const Vec3& point, double thickness_mm, bool across_gaps,
                                        std::optional<CellDistance>& distance) const;
  bool differs_at(const Piece& piece, const Vec3& point, const CellParam& hint);

  std::shared_ptr<const LimitSolid> solid_;
  const Placement voxel_of_mesh_, mesh_of_voxel_;
  const std::vector<ChannelTolerance> channels_;
  const InversionOptions inversion_;
  const bool proved_;
  double sure_share_;  // Shells less deep, as a share of the thickness of what lies there, stay within the tolerance.
  std::optional<PointInverter> inverter_;  // Where it is needed.
  std::vector<double> values_;

  // About the cell at hand: those whose boxes meet its own.
  std::optional<LimitCellId> cell_;
  std::vector<Touching> touching_;
  std::vector<LimitCellId> others_;
  double least_thickness_mm_ = 0;  // Of those that touch it.
  bool irregular_ = false;         // The cell is, or one that touches it.
  BlockShell shell_;
};

}  // namespace ccslice
