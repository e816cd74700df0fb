// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/surface_normals.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>

namespace ccslice::cli {

SurfaceNormals::SurfaceNormals(std::span<const std::array<double, 3>> points,
                               std::span<const std::array<std::uint32_t, 3>> triangles, double crease_deg)
    : triangles_(triangles),
      least_cosine_(std::cos(crease_deg * std::numbers::pi / 180)),
      first_of_vertex_(points.size() + 1),
      of_vertex_(3 * triangles.size()) {
  const auto point = [&](std::uint32_t vertex) { return Vec3(points[vertex].data()); };
  for (const auto& [a, b, c] : triangles) {
    areas_.push_back((point(b) - point(a)).cross(point(c) - point(a)));
    for (const std::uint32_t vertex : {a, b, c}) ++first_of_vertex_[vertex + 1];
  }
  std::partial_sum(first_of_vertex_.begin(), first_of_vertex_.end(), first_of_vertex_.begin());
  std::vector<std::uint32_t> next(first_of_vertex_.begin(), first_of_vertex_.end() - 1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t vertex : triangles[t]) of_vertex_[next[vertex]++] = t;
  }
}

Vec3 SurfaceNormals::at_vertex(std::uint32_t triangle, std::uint32_t vertex) const {
  const Vec3& own = areas_[triangle];
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t i = first_of_vertex_[vertex]; i < first_of_vertex_[vertex + 1]; ++i) {
    const Vec3& other = areas_[of_vertex_[i]];
    if (other.dot(own) >= least_cosine_ * other.norm() * own.norm()) sum += other;
  }
  return sum.normalized();
}

Vec3 SurfaceNormals::at(std::uint32_t triangle, const std::array<float, 3>& weights) const {
  Vec3 normal = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    normal += static_cast<double>(weights[k]) * at_vertex(triangle, triangles_[triangle][k]);
  }
  return normal.normalized();
}

}  // namespace ccslice::cli
