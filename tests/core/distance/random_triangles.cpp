// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/core/distance/random_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccslice {

Vec3 random_point(std::mt19937& random, double low, double high) {
  std::uniform_real_distribution<double> coordinate(low, high);
  const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
  return {x, y, z};
}

std::vector<FloatTriangle> random_triangles(std::mt19937& random, std::size_t count, double size) {
  std::vector<FloatTriangle> triangles;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 at = random_point(random, 0, 10);
    FloatTriangle& triangle = triangles.emplace_back();
    for (FloatPoint& corner : triangle) corner = to_float_point(at + random_point(random, -size, size));
    if (i % 17 == 3) triangle[1] = triangle[0];
    if (i % 17 == 5) triangle[2] = triangle[1] = triangle[0];
    if (i % 17 == 11) triangle[2] = triangle[1];
    if (i % 17 == 13 || i % 17 == 6) {  // Two corners that floats hardly tell apart.
      const double apart = std::pow(10.0, -static_cast<double>(random() % 12));
      triangle[2] = to_float_point(to_vec3(triangle[1]) + random_point(random, -apart, apart));
    }
    if (i % 17 == 7) triangle[2] = to_float_point(0.5 * (to_vec3(triangle[0]) + to_vec3(triangle[1])));
  }
  return triangles;
}

Vec3 exact_nearest_place(const FloatTriangle& triangle, const Vec3& point) {
  const Vec3 a = to_vec3(triangle[0]), b = to_vec3(triangle[1]), c = to_vec3(triangle[2]);
  const Vec3 ab = b - a, ac = c - a, ap = point - a, bp = point - b, cp = point - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  const auto on_edge = [](const Vec3& from, const Vec3& edge, const Vec3& p) {
    const double squared = edge.squaredNorm();
    return Vec3(from + (squared > 0 ? std::clamp(edge.dot(p - from) / squared, 0.0, 1.0) : 0.0) * edge);
  };
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2, sum = va + vb + vc;
  if (va > 0 && vb > 0 && vc > 0) return a + ab * (vb / sum) + ac * (vc / sum);
  Vec3 nearest = on_edge(a, ab, point);
  for (const Vec3& other : {on_edge(a, ac, point), on_edge(b, c - b, point)}) {
    if ((other - point).norm() < (nearest - point).norm()) nearest = other;
  }
  return nearest;
}

double exact_distance(const std::vector<FloatTriangle>& triangles, const Vec3& point) {
  double least = std::numeric_limits<double>::infinity();
  for (const FloatTriangle& triangle : triangles) {
    least = std::min(least, (point - exact_nearest_place(triangle, point)).norm());
  }
  return least;
}

}  // namespace ccslice
