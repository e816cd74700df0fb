// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A first guess of a point's parameters in each limit-ready cell.
//
// Maps are kept in floats, as a tetrahedron has 32 of them, and their middles relative to the middle of the solid.
// Hulls are rounded outwards, and made with maps as they were rounded: what they rule out is ruled out for certain.

#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/types.h"

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
  /// The cell may meet the box, mesh frame.
  bool may_meet(const Box3& box) const {
    const Vec3 reach = inverse_jacobian.cwiseAbs() * (0.5 * box.diagonal()) + kRounding * hull.diagonal();
    const Vec3 middle = (*this)(box.center());
    return ((middle + reach).array() >= hull.min().array()).all() &&
           ((middle - reach).array() <= hull.max().array()).all();
  }

 private:
  static constexpr double kRounding = 1e-9;
};

/// The maps of a solid, by cell.
class CellMaps {
 public:
  /// `origin`: near all cells, mm.
  void resize(std::size_t cells, const Vec3& origin) {
    maps_.resize(cells);
    origin_ = origin;
  }

  // Cells may be set on several threads, each by one.
  /// Rounds the map. An inverse Jacobian that isn't finite counts as none.
  void set(LimitCellId cell, const Vec3& middle, const Mat3& inverse_jacobian) {
    const Eigen::Matrix3f rounded = inverse_jacobian.cast<float>();
    Packed& map = maps_[cell];
    map.middle = (middle - origin_).cast<float>();
    map.inverse_jacobian = rounded.allFinite() ? rounded : Eigen::Matrix3f::Zero().eval();
  }
  /// The guesses of the map that was set, as [] has it, for all points of the cell.
  void set_hull(LimitCellId cell, const Box3& guesses) {
    constexpr float kRounding = std::numeric_limits<float>::epsilon();
    const Eigen::Array3f min = guesses.min().cast<float>().array(), max = guesses.max().cast<float>().array();
    maps_[cell].hull_min = min - kRounding * min.abs();
    maps_[cell].hull_max = max + kRounding * max.abs();
  }

  CellMap operator[](LimitCellId cell) const {
    const Packed& map = maps_[cell];
    return {origin_ + map.middle.cast<double>(), map.inverse_jacobian.cast<double>(),
            Box3(map.hull_min.cast<double>().matrix(), map.hull_max.cast<double>().matrix())};
  }
  std::size_t memory_bytes() const { return maps_.capacity() * sizeof(Packed); }

 private:
  struct Packed {
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    Eigen::Matrix3f inverse_jacobian = Eigen::Matrix3f::Zero();
    Eigen::Array3f hull_min = Eigen::Array3f::Zero(), hull_max = Eigen::Array3f::Zero();
  };

  Vec3 origin_ = Vec3::Zero();
  std::vector<Packed> maps_;
};

}  // namespace ccslice
