// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Triangles by place, eight in a group, which are compared with a point at once. Groups follow a Morton curve through
// the triangles' middles; over them lies a binary tree of boxes.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/lanes.h"
#include "core/distance/triangle_lanes.h"

namespace ccslice {

struct FloatBox {
  FloatPoint min, max;

  /// Infinite for boxes of nothing.
  float squared_distance(const FloatPoint& point) const noexcept {
    float sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const float beyond = std::max({min[a] - point[a], point[a] - max[a], 0.0f});
      sum += beyond * beyond;
    }
    return sum;
  }
  FloatLanes squared_distances(const PointLanes& points) const noexcept {
    FloatLanes sum = {};
    for (std::size_t a = 0; a < 3; ++a) {
      const FloatLanes beyond = greater(greater(min[a] - points[a], points[a] - max[a]), FloatLanes{});
      sum = multiply_add(beyond, beyond, sum);
    }
    return sum;
  }
  float squared_distance(const FloatBox& other) const noexcept {
    float sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const float apart = std::max({min[a] - other.max[a], other.min[a] - max[a], 0.0f});
      sum += apart * apart;
    }
    return sum;
  }
};

class TriangleTree {
 public:
  /// REQUIRES: at least one triangle, all numbers finite.
  explicit TriangleTree(std::vector<FloatTriangle> triangles);

  /// The box of all triangles.
  const FloatBox& box() const noexcept { return boxes_[1]; }
  double area_mm2() const noexcept { return area_mm2_; }
  std::size_t group_count() const noexcept { return groups_.size(); }
  const FloatBox& box(std::uint32_t group) const noexcept { return boxes_[leaves_ + group]; }
  /// The last triangle comes again in lanes without one.
  const TriangleLanes& group(std::uint32_t group) const noexcept { return groups_[group]; }

  /// All groups with boxes within `bound` of this one.
  std::vector<std::uint32_t> find_near(const FloatBox& box, float bound) const;

  /// At most, for large numbers of triangles.
  static constexpr std::size_t kBytesPerGroup = sizeof(TriangleLanes) + 4 * sizeof(FloatBox);

 private:
  std::vector<TriangleLanes> groups_;
  std::vector<FloatBox> boxes_;  // A heap: node i has children 2 i and 2 i + 1, the groups come from leaves_ on.
  std::size_t leaves_ = 1;       // A power of two.
  double area_mm2_ = 0;
};

}  // namespace ccslice
