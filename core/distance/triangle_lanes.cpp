// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/triangle_lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccslice {
namespace {

constexpr double kFlat = 1e-7;  // Of the longest edge: a smaller height is rounding.

Vec3 lane_of(const PointLanes& points, std::size_t lane) { return {points[0][lane], points[1][lane], points[2][lane]}; }

void set_lane(PointLanes& points, std::size_t lane, const Vec3& point) {
  for (std::size_t a = 0; a < 3; ++a) points[a][lane] = static_cast<float>(point[static_cast<Eigen::Index>(a)]);
}

}  // namespace

void TriangleLanes::set(std::size_t lane, const FloatTriangle& triangle) noexcept {
  const std::array<Vec3, 3> corners = {to_vec3(triangle[0]), to_vec3(triangle[1]), to_vec3(triangle[2])};
  std::array<double, 3> squared;
  for (std::size_t i = 0; i < 3; ++i) squared[i] = (corners[(i + 1) % 3] - corners[i]).squaredNorm();
  const auto first = static_cast<std::size_t>(std::ranges::max_element(squared) - squared.begin());
  const Vec3& a = corners[first];
  const Vec3 to_b = corners[(first + 1) % 3] - a, to_c = corners[(first + 2) % 3] - a;
  const double ab = std::sqrt(squared[first]);
  const Vec3 u = ab > 0 ? Vec3(to_b / ab) : Vec3::UnitX();
  const double along = to_c.dot(u);
  const Vec3 across = to_c - along * u;
  const bool is_flat = across.norm() <= kFlat * ab;
  const double height = is_flat ? 0 : across.norm();
  const Vec3 v = is_flat ? u.unitOrthogonal() : Vec3(across / height);
  const double bc = std::hypot(along - ab, height), ac = std::hypot(along, height);
  set_lane(corner_, lane, a);
  set_lane(u_, lane, u);
  set_lane(v_, lane, v);
  set_lane(w_, lane, u.cross(v));
  ab_[lane] = static_cast<float>(ab);
  bc_mm_[lane] = static_cast<float>(bc);
  ac_mm_[lane] = static_cast<float>(ac);
  // Edges without length have any direction.
  const auto set_direction = [&](std::array<FloatLanes, 2>& edge, double du, double dv, double length) {
    edge[0][lane] = static_cast<float>(length > 0 ? du / length : 1);
    edge[1][lane] = static_cast<float>(length > 0 ? dv / length : 0);
  };
  set_direction(bc_, along - ab, height, bc);
  set_direction(ac_, along, height, ac);
}

Vec3 TriangleLanes::nearest_place(std::size_t lane, const Vec3& point) const noexcept {
  const Vec3 a = lane_of(corner_, lane), axis_u = lane_of(u_, lane), axis_v = lane_of(v_, lane);
  const Eigen::Vector2d p(axis_u.dot(point - a), axis_v.dot(point - a));
  const Eigen::Vector2d b(ab_[lane], 0), ac(ac_[0][lane], ac_[1][lane]), bc(bc_[0][lane], bc_[1][lane]);
  Eigen::Vector2d nearest = p;
  double squared = std::numeric_limits<double>::infinity();
  bool above = true;
  const auto look = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& direction, double length, double side) {
    const Eigen::Vector2d q = p - from;
    above = above && side * (direction.x() * q.y() - direction.y() * q.x()) > 0;
    const Eigen::Vector2d place = from + std::clamp(direction.dot(q), 0.0, length) * direction;
    if ((p - place).squaredNorm() >= squared) return;
    squared = (p - place).squaredNorm();
    nearest = place;
  };
  look(Eigen::Vector2d::Zero(), Eigen::Vector2d::UnitX(), ab_[lane], 1);
  look(b, bc, bc_mm_[lane], 1);
  look(Eigen::Vector2d::Zero(), ac, ac_mm_[lane], -1);
  if (above) nearest = p;
  return a + nearest.x() * axis_u + nearest.y() * axis_v;
}

}  // namespace ccslice
