// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/surface_raster.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace ccslice::cli {
namespace {

/// Twice the area of edge and ray, positive on the left of who goes from a to b. Of b and a just the negative.
double side_of(std::uint32_t a, std::uint32_t b, const std::vector<Vec3>& points, double column, double row) {
  if (a > b) return -side_of(b, a, points, column, row);
  const Vec3 &from = points[a], &to = points[b];
  return (to.x() - from.x()) * (row - from.y()) - (to.y() - from.y()) * (column - from.x());
}

/// A ray that goes right through an edge counts as on the left of it from its lower vertex to its higher one.
bool is_left(double side, std::uint32_t a, std::uint32_t b) { return a < b ? side >= 0 : side > 0; }

struct Meeting {
  double depth;
  std::array<float, 3> weights;
  int inwards;  // 1, or -1 where the ray leaves what the triangle bounds.
};

std::optional<Meeting> meet(const std::array<std::uint32_t, 3>& triangle, const std::vector<Vec3>& points, int column,
                            int row) {
  const auto [a, b, c] = triangle;
  const double at_a = side_of(b, c, points, column, row), at_b = side_of(c, a, points, column, row),
               at_c = side_of(a, b, points, column, row), area = at_a + at_b + at_c;
  const int lefts = is_left(at_a, b, c) + is_left(at_b, c, a) + is_left(at_c, a, b);
  if ((lefts != 0 && lefts != 3) || area == 0) return std::nullopt;
  const Vec3 share = Vec3(at_a, at_b, at_c) / area;
  const double depth = share[0] * points[a].z() + share[1] * points[b].z() + share[2] * points[c].z();
  // Rows grow downwards: a triangle that is seen from outside looks clockwise here.
  return Meeting{depth,
                 {static_cast<float>(share[0]), static_cast<float>(share[1]), static_cast<float>(share[2])},
                 lefts == 0 ? 1 : -1};
}

void keep_nearer(std::uint32_t triangle, const Meeting& meeting, RayHit& hit) {
  if (meeting.depth < hit.depth) hit = {triangle, meeting.depth, meeting.weights};
}

/// Whole numbers from `first` to `last`.
struct Range {
  int first, last;
};

/// Those from `low` to `high` that are at least `least` and below `end`.
Range whole_numbers(double low, double high, int least, int end) {
  return {static_cast<int>(std::clamp<double>(std::ceil(low), least, end)),
          static_cast<int>(std::clamp<double>(std::floor(high), least - 1.0, end - 1.0))};
}

}  // namespace

void Stretch::clip(double origin, double way, double bound, double sign) {
  const double rate = sign * way, room = sign * (origin - bound);
  if (std::abs(rate) < 1e-12) {
    if (room < 0) first = std::numeric_limits<double>::infinity();
  } else if (rate > 0) {
    first = std::max(first, -room / rate);
  } else {
    last = std::min(last, -room / rate);
  }
}

SurfaceRaster::SurfaceRaster(std::vector<Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles,
                             double slack)
    : points_(std::move(points)), triangles_(triangles), slack_(slack) {}

std::vector<RayHits> SurfaceRaster::hits(int columns, int row_begin, int row_end, std::span<const Stretch> away) const {
  std::vector<RayHits> hits(away.size());
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const Vec3 &a = points_[triangles_[t][0]], &b = points_[triangles_[t][1]], &c = points_[triangles_[t][2]];
    const Vec3 low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    const Range along = whole_numbers(low.x(), high.x(), 0, columns);
    const Range down = whole_numbers(low.y(), high.y(), row_begin, row_end);
    for (int row = down.first; row <= down.last; ++row) {
      for (int column = along.first; column <= along.last; ++column) {
        const std::optional<Meeting> meeting = meet(triangles_[t], points_, column, row);
        if (!meeting) continue;
        const std::size_t ray = static_cast<std::size_t>(row - row_begin) * static_cast<std::size_t>(columns) +
                                static_cast<std::size_t>(column);
        const Stretch& gone = away[ray];
        if (gone.empty() || meeting->depth < gone.first) keep_nearer(t, *meeting, hits[ray].before);
        if (gone.empty()) continue;
        if (meeting->depth <= gone.last - meeting->inwards * slack_) {
          hits[ray].winding += meeting->inwards;
        } else {
          keep_nearer(t, *meeting, hits[ray].behind);
        }
      }
    }
  }
  return hits;
}

}  // namespace ccslice::cli
