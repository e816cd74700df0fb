// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the limit-ready cells of a solid are: what finds the cells near a point or a box, and a first guess of a
// point's parameters in each.

#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/types.h"
#include "core/limit/box_tree.h"
#include "core/limit/cell_hulls.h"

namespace ccslice {

/// A first guess of the parameters of a point near a cell, to first order about the cell's middle.
struct CellMap {
  Vec3 middle = Vec3::Zero();            // geo(1/2, 1/2, 1/2), mm.
  Mat3 inverse_jacobian = Mat3::Zero();  // There; zero where it has none.
  Box3 hull;                             // Holds the guesses for all points of the cell: a sheared box around it.

  Vec3 operator()(const Vec3& point) const { return Vec3::Constant(0.5) + inverse_jacobian * (point - middle); }
  /// About, and at most, its least extent; infinite where there is no Jacobian.
  double thickness_mm() const { return 1 / inverse_jacobian.norm(); }
  /// The cell may come as near as that to the point that was guessed.
  bool may_hold(const Vec3& guess, double distance_mm) const {
    const Vec3 margin = distance_mm * inverse_jacobian.cwiseAbs().rowwise().sum() + kRounding * hull.diagonal();
    return ((guess - hull.min() + margin).array() >= 0).all() && ((hull.max() - guess + margin).array() >= 0).all();
  }

 private:
  static constexpr double kRounding = 1e-9;
};

/// About, by the Jacobians in the middle of cells; infinite where there is none. mm^3.
struct CellVolumes {
  double least = std::numeric_limits<double>::infinity(), most = 0;
};

struct CellIndex {
  std::vector<CellMap> cell_maps;  // By cell.
  CellVolumes regular_volumes, irregular_volumes;
  BoxTree cell_boxes;                   // Bounding boxes of the cells' limits, mesh frame.
  BoxTree fold_boxes;                   // Boxes of the cells that fold, or may fold.
  std::vector<LimitCellId> fold_cells;  // Those cells, ascending.
  CellHulls hulls_near_folds;           // Hulls of the cells whose boxes meet those of fold_boxes.
  BoxTree overlap_boxes;                // Boxes of the cells that may overlap a separate part of the solid.
  std::vector<std::uint32_t> parts;     // By cell: its part, numbered by first cells. Empty if no parts overlap.

  /// The solid may fold in this box, or separate parts of it may overlap there: a point may have several parameters.
  bool is_ambiguous(const Box3& box) const noexcept {
    const auto any = [](std::uint32_t) { return true; };
    return fold_boxes.any_meeting(box, any) || overlap_boxes.any_meeting(box, any);
  }
  double volume_mm3(LimitCellId cell) const { return 1 / std::abs(cell_maps[cell].inverse_jacobian.determinant()); }
};

}  // namespace ccslice
