// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Squared distances from a point to eight triangles at once.
//
// Each triangle has a frame of its own: A = (0, 0), B = (b, 0), C = (c, h) in its plane, its longest edge along u, and
// w from the plane. In the plane an edge has the unit direction e; with p from the edge's first corner, s = e x p is
// positive on the side of the triangle, and t = e . p. A point is above the triangle if every s is positive, and w away
// from it; else its nearest place is on an edge, and s^2 + (t - clamp(t, 0, length))^2 + w^2 is the least of three.

#pragma once

#include <array>
#include <cstddef>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/distance/float_points.h"

namespace ccslice {

/// x, y, z, a point a lane.
using PointLanes = std::array<FloatLanes, 3>;

inline PointLanes in_all_lanes(const FloatPoint& point) noexcept {
  return {FloatLanes{} + point[0], FloatLanes{} + point[1], FloatLanes{} + point[2]};
}

/// A triangle a lane.
class TriangleLanes {
 public:
  void set(std::size_t lane, const FloatTriangle& triangle) noexcept;

  FloatLanes squared_distances(const PointLanes& point) const noexcept {
    const PointLanes p = {point[0] - corner_[0], point[1] - corner_[1], point[2] - corner_[2]};
    const FloatLanes u = dot(u_, p), v = dot(v_, p), w = dot(w_, p), from_b = u - ab_;
    const FloatLanes t_bc = multiply_add(bc_[0], from_b, bc_[1] * v), s_bc = bc_[0] * v - bc_[1] * from_b;
    const FloatLanes t_ac = multiply_add(ac_[0], u, ac_[1] * v), s_ac = ac_[1] * u - ac_[0] * v;
    const FloatLanes on_edge =
        lesser(lesser(to_edge(v, u, ab_), to_edge(s_bc, t_bc, bc_mm_)), to_edge(s_ac, t_ac, ac_mm_));
    const auto above = lesser(lesser(v, s_bc), s_ac) > 0;  // Never over a triangle that is flat to a line or point.
    return multiply_add(w, w, above ? FloatLanes{} : on_edge);
  }

  /// The greatest n z of places z of each triangle.
  FloatLanes most_along(const FloatPoint& n) const noexcept {
    const PointLanes direction = in_all_lanes(n);
    const FloatLanes a = dot(direction, corner_), u = dot(direction, u_), v = dot(direction, v_);
    const FloatLanes to_c = ac_mm_ * multiply_add(ac_[0], u, ac_[1] * v);
    return a + greater(greater(FloatLanes{}, ab_ * u), to_c);
  }
  /// The place of a triangle that is nearest to the point.
  Vec3 nearest_place(std::size_t lane, const Vec3& point) const noexcept;

 private:
  static FloatLanes dot(const PointLanes& a, const PointLanes& b) noexcept {
    return multiply_add(a[2], b[2], multiply_add(a[1], b[1], a[0] * b[0]));
  }
  static FloatLanes to_edge(FloatLanes s, FloatLanes t, FloatLanes length) noexcept {
    const FloatLanes beyond = t - lesser(greater(t, FloatLanes{}), length);
    return multiply_add(s, s, beyond * beyond);
  }

  PointLanes corner_ = {}, u_ = {}, v_ = {}, w_ = {};  // A, and the unit vectors of the frame.
  FloatLanes ab_ = {}, bc_mm_ = {}, ac_mm_ = {};       // Lengths.
  std::array<FloatLanes, 2> bc_ = {}, ac_ = {};        // Directions.
};

}  // namespace ccslice
