// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points and nets of eight cells that are alike, worked on at once, a lane each. Floats: what they lose counts as slack
// in what is proved with them.
//
// Private to core/limit.

#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "core/base/lanes.h"
#include "core/subdivision/ring.h"

namespace ccslice {

/// A point, or a difference of two, of each cell.
struct PointLanes {
  FloatLanes x, y, z;

  PointLanes operator+(const PointLanes& other) const noexcept { return {x + other.x, y + other.y, z + other.z}; }
  PointLanes operator-(const PointLanes& other) const noexcept { return {x - other.x, y - other.y, z - other.z}; }
  friend PointLanes operator*(float factor, const PointLanes& p) noexcept {
    return {factor * p.x, factor * p.y, factor * p.z};
  }
};

inline PointLanes multiply_add(const PointLanes& a, float b, const PointLanes& c) noexcept {
  return {multiply_add(a.x, b, c.x), multiply_add(a.y, b, c.y), multiply_add(a.z, b, c.z)};
}

/// The box around some vectors.
struct BoxLanes {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr FloatLanes kHuge = {kInfinity, kInfinity, kInfinity, kInfinity,
                                       kInfinity, kInfinity, kInfinity, kInfinity};

  PointLanes low = {kHuge, kHuge, kHuge}, high = {-kHuge, -kHuge, -kHuge};

  void extend(const PointLanes& p) noexcept {
    low = {lesser(low.x, p.x), lesser(low.y, p.y), lesser(low.z, p.z)};
    high = {greater(high.x, p.x), greater(high.y, p.y), greater(high.z, p.z)};
  }
  void grow(FloatLanes margin) noexcept {
    const PointLanes all = {margin, margin, margin};
    low = low - all, high = high + all;
  }
};

/// Bit k: no matrix whose columns lie in the k-th cell's boxes is singular or mirrors. So det J is positive wherever
/// the columns of J are averages of what the boxes hold. With centre C and radius R, any such matrix is
/// C (I + C^-1 D) with |D| <= R, and regular if I - |C^-1| R is an M-matrix.
unsigned proper_lanes(const std::array<BoxLanes, 3>& columns) noexcept;

/// Grids of 4, 4 x 4 or 4 x 4 x 4 points, index i + 4 j + 16 k, as patch.h has them: phantom layers, and Bezier points
/// instead of those of a B-spline.
void fill_phantoms(std::span<PointLanes> grid, PhantomMask phantoms) noexcept;
void bspline_to_bezier(std::span<PointLanes> grid) noexcept;

/// Extends the boxes by the differences of a net of 4 x 4 x 4 points along each axis, which its Jacobians' columns are
/// averages of, but for a factor of 3.
void extend_by_differences(std::span<const PointLanes> net, std::array<BoxLanes, 3>& columns) noexcept;

}  // namespace ccslice
