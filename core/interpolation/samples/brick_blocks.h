// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Forward samples of a box of several cells at once (limit/cell_bricks.h), and how far they may be off.
//
// Over a box of a brick's parameters position and channels are a B-spline X with knots between its cells. Let Q be the
// tricubic polynomial that equals X at 4 x 4 x 4 Chebyshev nodes of the cells that hold the box. A polynomial has
// control points, too, those of its blossom at the knots. So X - Q is a B-spline whose control points are the
// differences, and as the basis functions are positive and their sum is 1,
//
//   |X - Q| <= max |X_ijk - Q_ijk|    over the control points that the box depends on.
//
// Samples are those of Q, so that all that holds of one patch holds of them; the RESIDUALS bound the rest. Four cells
// turn oftener than one does, so how far Q bulges beyond the box of its samples is bounded, too: interpolation between
// nodes along an axis leaves out an eighth of the largest second difference there at most.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/lanes.h"
#include "core/interpolation/samples/cell_block.h"
#include "core/limit/cell_bricks.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// Bounds of |X - Q|. Zero within one cell.
struct BrickResiduals {
  Vec3 position = Vec3::Zero();
  std::vector<double> values;  // By channel asked for.
  /// How far positions of Q may lie beyond the box of its samples. Zero within one cell, where it isn't looked for.
  Vec3 bulge = Vec3::Zero();
};

/// One solid, one thread.
class BrickSampler {
 public:
  /// REQUIRES: the solid outlives this.
  BrickSampler(const LimitSolid& solid, std::vector<std::uint32_t> channels);

  /// Samples Q at the box's nodes. Positions, their residuals and bulges are in mm of the mesh.
  void sample(const CellBrick& brick, const ParamBox& box, CellBlock& block, BrickResiduals& residuals);

 private:
  static constexpr std::size_t kMostPoints = CellBricks::kMostCells + 3;  // Along an axis.

  /// Along one axis.
  struct Axis {
    std::size_t first = 0, points = 0;                         // Control points that the box depends on.
    std::array<std::array<double, kMostPoints>, 4> at_sites;   // X at the Chebyshev nodes by control points.
    std::array<std::array<double, 4>, kMostPoints> of_points;  // Control points of Q by its values there.
    std::array<std::array<double, 4>, kBlockNodes> at_nodes;   // Q at the box's nodes by them.
  };

  static Axis axis_of(double low, double high);
  void load_points(const CellBrick& brick, std::size_t first_lane, std::size_t channel, std::size_t count);
  void fill_phantoms(const CellBrick& brick);
  void contract_to_sites();
  Lanes largest_residual() const;

  const LimitSolid::Data& data_;
  const std::vector<std::uint32_t> channels_;
  // The box at hand, a point's numbers by fours:
  std::array<Axis, 3> axes_;
  std::array<Lanes, kMostPoints * kMostPoints * kMostPoints> points_;  // kMostPoints apart along each axis.
  std::array<Lanes, 64> sites_;
};

}  // namespace ccslice
