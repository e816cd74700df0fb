// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/winding_number.h"

#include <algorithm>
#include <limits>

namespace ccslice::oracle {
namespace {

/// Positive: p is left of the line from a to b.
double is_left(const Vec2& a, const Vec2& b, const Vec2& p) {
  return (b.x() - a.x()) * (p.y() - a.y()) - (p.x() - a.x()) * (b.y() - a.y());
}

double distance_to_segment(const Vec2& a, const Vec2& b, const Vec2& p) {
  const Vec2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (a + t * ab - p).norm();
}

}  // namespace

int winding_number(std::span<const Polygon> polygons, const Vec2& point) {
  int winding = 0;
  for (const Polygon& polygon : polygons) {
    const Vec2* a = polygon.data() + polygon.size() - 1;
    for (const Vec2& b : polygon) {
      if (a->y() <= point.y()) {
        if (b.y() > point.y() && is_left(*a, b, point) > 0) ++winding;
      } else if (b.y() <= point.y() && is_left(*a, b, point) < 0) {
        --winding;
      }
      a = &b;
    }
  }
  return winding;
}

double distance_to(std::span<const Polygon> polygons, const Vec2& point) {
  double least = std::numeric_limits<double>::infinity();
  for (const Polygon& polygon : polygons) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      least = std::min(least, distance_to_segment(polygon[i], polygon[(i + 1) % polygon.size()], point));
    }
  }
  return least;
}

}  // namespace ccslice::oracle
