// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/cut_plane.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/job.h"

namespace ccslice::cli {
namespace {

constexpr double kBorderShare = 0.02;  // Round the part, of the longer side.
constexpr double kLevel = 1e-9;

Vec3 vec3_of(const v1::Vector3& message) { return {message.x(), message.y(), message.z()}; }

v1::Vector3 message_of(const Vec3& value) { return client::vector_of(value.x(), value.y(), value.z()); }

Box3 box_of(const v1::Box3& message) { return {vec3_of(message.min_mm()), vec3_of(message.max_mm())}; }

/// The least and the most of the box along a direction.
std::pair<double, double> extent_along(const Vec3& direction, const Box3& box) {
  double low = 0, high = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double at_min = direction[axis] * box.min()[axis], at_max = direction[axis] * box.max()[axis];
    low += std::min(at_min, at_max);
    high += std::max(at_min, at_max);
  }
  return {low, high};
}

CutPlane plane_of(const Vec3& point, const Vec3& normal) {
  CutPlane plane;
  plane.point = point;
  plane.normal = normal.normalized();
  Vec3 up = Vec3::UnitZ() - plane.normal.z() * plane.normal;
  if (up.norm() < kLevel) up = Vec3::UnitY();
  plane.up = up.normalized();
  plane.across = plane.up.cross(plane.normal);
  return plane;
}

}  // namespace

CutPlane parse_cut_plane(const std::string& text) {
  constexpr std::string_view kAxes = "xyz";
  const std::size_t axis = text.size() > 2 && text[1] == '=' ? kAxes.find(text[0]) : std::string_view::npos;
  if (axis != std::string_view::npos) {
    Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
    point[static_cast<Eigen::Index>(axis)] = parse_number("--plane", std::string_view(text).substr(2));
    normal[static_cast<Eigen::Index>(axis)] = axis == 1 ? -1 : 1;  // So that x goes to the right in it.
    return plane_of(point, normal);
  }
  const std::vector<std::string> parts = split(text, ':');
  if (parts.size() != 2) {
    throw UsageError("--plane takes an axis and a place, as in z=12.5, or a point and a normal, X,Y,Z:NX,NY,NZ, not '" +
                     text + "'");
  }
  const std::vector<double> point = parse_numbers("--plane", parts[0], 3, 3);
  const std::vector<double> normal = parse_numbers("--plane", parts[1], 3, 3);
  const Vec3 direction(normal[0], normal[1], normal[2]);
  const double longest = direction.cwiseAbs().maxCoeff();
  if (!(longest > 0)) throw UsageError("--plane: a normal of 0,0,0 has no direction");
  return plane_of(Vec3(point[0], point[1], point[2]), direction / longest);
}

FramedCut frame_cut(const CutPlane& plane, const v1::Box3& message, std::uint32_t pixels) {
  const Box3 box = box_of(message);
  const auto [left, right] = extent_along(plane.across, box);
  const auto [bottom, top] = extent_along(plane.up, box);
  const double border = kBorderShare * std::max(right - left, top - bottom);
  const double width = right - left + 2 * border, height = top - bottom + 2 * border;
  const double pixel = std::max(width, height) / pixels;
  FramedCut framed;
  framed.width = std::max(1u, static_cast<std::uint32_t>(std::ceil(width / pixel - 1e-6)));
  framed.height = std::max(1u, static_cast<std::uint32_t>(std::ceil(height / pixel - 1e-6)));
  const Vec3 middle =
      0.5 * (left + right) * plane.across + 0.5 * (bottom + top) * plane.up + height_of(plane) * plane.normal;
  *framed.plane.mutable_middle_mm() = message_of(middle);
  *framed.plane.mutable_across() = message_of(plane.across);
  *framed.plane.mutable_up() = message_of(plane.up);
  framed.plane.set_across_mm_per_pixel(pixel);
  return framed;
}

CutPlane moved_to(const CutPlane& plane, const v1::Box3& box, double share) {
  const auto [low, high] = extent_along(plane.normal, box_of(box));
  CutPlane moved = plane;
  moved.point += (low + share * (high - low) - height_of(plane)) * plane.normal;
  return moved;
}

double height_of(const CutPlane& plane) { return plane.point.dot(plane.normal); }

}  // namespace ccslice::cli
