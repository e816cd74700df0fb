// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/distance_cube.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/error.h"

namespace ccslice {
namespace {

constexpr float kUnbounded = std::numeric_limits<float>::infinity();

/// The corners of a cube, a lane each, and squared distances that are above those from there to a place.
class CornerBounds {
 public:
  CornerBounds(const DistanceCube& cube, const Vec3& place, double rounding_mm) {
    for (unsigned c = 0; c < kFloatLanes; ++c) {
      const Vec3 corner = cube.middle + 2 * (cube.child(c).middle - cube.middle);
      for (std::size_t a = 0; a < 3; ++a) corners_[a][c] = static_cast<float>(corner[static_cast<Eigen::Index>(a)]);
      const double bound = (corner - place).norm() + rounding_mm;
      squared_[c] = static_cast<float>(bound * bound);
    }
  }

  bool may_be_nearest(const FloatBox& box) const {
    return float_lanes_of(box.squared_distances(corners_) <= squared_) != 0;
  }
  /// The triangles that may, a bit each.
  unsigned may_be_nearest(const TriangleLanes& group) const {
    unsigned nearer = 0;
    for (unsigned c = 0; c < kFloatLanes; ++c) {
      const PointLanes corner = in_all_lanes({corners_[0][c], corners_[1][c], corners_[2][c]});
      nearer |= float_lanes_of(group.squared_distances(corner) <= squared_[c]);
    }
    return nearer;
  }

 private:
  PointLanes corners_ = {};
  FloatLanes squared_ = {};
};

}  // namespace

void throw_if_cancelled_in_place(const CancellationToken& cancel) {
  if (cancel.cancelled()) throw Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline");
}

DistanceCube DistanceCube::child(unsigned number) const {
  const auto side = [&](unsigned axis) { return (number >> axis & 1) != 0 ? half / 2 : -half / 2; };
  return {middle + Vec3(side(0), side(1), side(2)), half / 2};
}

FloatBox DistanceCube::box() const {
  return {to_float_point(middle - Vec3::Constant(half)), to_float_point(middle + Vec3::Constant(half))};
}

double DistanceCube::radius() const { return std::numbers::sqrt3 * half; }

Vec3 nearest_place(const TriangleTree& triangles, std::span<const std::uint32_t> groups, const Vec3& point) {
  const PointLanes in_lanes = in_all_lanes(to_float_point(point));
  float squared = kUnbounded;
  const TriangleLanes* nearest = nullptr;
  std::size_t lane = 0;
  for (const std::uint32_t group : groups) {
    const FloatLanes of_group = triangles.group(group).squared_distances(in_lanes);
    for (std::size_t k = 0; k < kFloatLanes; ++k) {
      if (of_group[k] >= squared) continue;
      squared = of_group[k];
      nearest = &triangles.group(group);
      lane = k;
    }
  }
  return nearest->nearest_place(lane, point);
}

std::vector<std::uint32_t> nearest_somewhere(const TriangleTree& triangles, const DistanceCube& cube,
                                             std::span<const std::uint32_t> candidates, std::uint32_t nearest,
                                             bool by_triangles, double rounding_mm) {
  const CornerBounds bounds(cube, nearest_place(triangles, {&nearest, 1}, cube.middle), rounding_mm);
  std::vector<std::uint32_t> kept = {nearest};
  for (const std::uint32_t group : candidates) {
    if (group == nearest || !bounds.may_be_nearest(triangles.box(group))) continue;
    if (!by_triangles || bounds.may_be_nearest(triangles.group(group)) != 0) kept.push_back(group);
  }
  return kept;
}

DistanceSlab slab_of(const TriangleTree& triangles, const DistanceCube& cube, std::span<const std::uint32_t> groups,
                     double rounding_mm) {
  const Vec3 place = nearest_place(triangles, groups, cube.middle);
  const Vec3 from_surface = cube.middle - place;
  const double distance = from_surface.norm();
  DistanceSlab slab;
  slab.n = to_float_point(distance > 0 ? Vec3(from_surface / distance) : Vec3::UnitZ());
  const Vec3 n = to_vec3(slab.n);
  slab.most = -kUnbounded;
  const CornerBounds bounds(cube, place, rounding_mm);
  for (const std::uint32_t group : groups) {
    const unsigned may_be_nearest = bounds.may_be_nearest(triangles.group(group));
    const FloatLanes along = triangles.group(group).most_along(slab.n);
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
      if ((may_be_nearest >> lane & 1) != 0) slab.most = std::max(slab.most, along[lane]);
    }
  }
  double least = kUnbounded;
  for (unsigned child = 0; child < 8; ++child) {
    const DistanceCube eighth = cube.child(child);
    const Vec3 away = eighth.middle - nearest_place(triangles, groups, eighth.middle);
    const double from_middle = away.norm(), half = eighth.half;
    // d(x) - n x is the greatest in a corner.
    const double grows = half * (away / from_middle - n).cwiseAbs().sum() + 3 * half * half / (2 * from_middle);
    least = from_middle > 0 ? std::min(least, n.dot(eighth.middle) - from_middle - grows) : -kUnbounded;
  }
  slab.least = static_cast<float>(least - rounding_mm);
  slab.most += static_cast<float>(rounding_mm);
  return slab;
}

}  // namespace ccslice
