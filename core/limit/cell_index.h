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

/// A first guess of the parameters of a point near a cell, to first order about the cell's middle. In floats: of a
/// tetrahedron there are 32. The hull is rounded outwards, and takes the rest of the map as rounded, so what it rules
/// out is ruled out for certain.
class CellMap {
 public:
  /// Maps everything to 1/2.
  CellMap() = default;
  /// `middle`: geo(1/2, 1/2, 1/2), mm. The Jacobian there; the map is as by default where it has no inverse.
  CellMap(const Vec3& middle, const Mat3& inverse_jacobian) : middle_(middle.cast<float>()) {
    const Eigen::Matrix3f rounded = inverse_jacobian.cast<float>();
    if (rounded.allFinite()) inverse_jacobian_ = rounded;
  }

  Vec3 middle() const { return middle_.cast<double>(); }
  /// Zero where there is none.
  Mat3 inverse_jacobian() const { return inverse_jacobian_.cast<double>(); }
  Vec3 operator()(const Vec3& point) const { return Vec3::Constant(0.5) + inverse_jacobian() * (point - middle()); }
  /// About, and at most, the cell's least extent; infinite where there is no Jacobian.
  double thickness_mm() const { return 1 / inverse_jacobian().norm(); }

  /// The guesses for all points of the cell: a sheared box around it.
  void set_hull(const Box3& guesses) {
    hull_min_ = guesses.min().cast<float>().array();
    hull_max_ = guesses.max().cast<float>().array();
    hull_min_ -= kFloatRounding * hull_min_.abs();
    hull_max_ += kFloatRounding * hull_max_.abs();
  }
  Box3 hull() const { return {hull_min_.cast<double>().matrix(), hull_max_.cast<double>().matrix()}; }
  /// The cell may come as near as that to the point that was guessed.
  bool may_hold(const Vec3& guess, double distance_mm) const {
    const Box3 box = hull();
    const Vec3 margin = distance_mm * inverse_jacobian().cwiseAbs().rowwise().sum() + kRounding * box.diagonal();
    return ((guess - box.min() + margin).array() >= 0).all() && ((box.max() - guess + margin).array() >= 0).all();
  }

 private:
  static constexpr double kRounding = 1e-9;
  static constexpr float kFloatRounding = std::numeric_limits<float>::epsilon();

  Eigen::Vector3f middle_ = Eigen::Vector3f::Zero();
  Eigen::Matrix3f inverse_jacobian_ = Eigen::Matrix3f::Zero();
  Eigen::Array3f hull_min_ = Eigen::Array3f::Zero(), hull_max_ = Eigen::Array3f::Zero();
};

/// About, by the Jacobians in the middle of cells; infinite where there is none. mm^3.
struct CellVolumes {
  double least = std::numeric_limits<double>::infinity(), most = 0;
};

struct CellIndex {
  std::vector<CellMap> cell_maps;  // By cell.
  CellVolumes regular_volumes, irregular_volumes;
  FloatBoxTree cell_boxes;              // Bounding boxes of the cells' limits, mesh frame.
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
  double volume_mm3(LimitCellId cell) const { return 1 / std::abs(cell_maps[cell].inverse_jacobian().determinant()); }
};

}  // namespace ccslice
