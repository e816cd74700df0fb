// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where parallel rays, one through each place of a grid, meet a closed surface of triangles, when a stretch of each
// ray is taken away.
//
// A ray is on one side of an edge or on the other, as the edge's two vertices say, whatever triangle asks. So every ray
// goes through a closed surface as often inwards as outwards, and what is inside is known without a doubt, between
// triangles too.

#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice::cli {

/// A stretch of a ray, by depth; empty unless first < last.
struct Stretch {
  double first = -std::numeric_limits<double>::infinity(), last = std::numeric_limits<double>::infinity();

  bool empty() const { return !(first < last); }
  /// Keeps where sign * (origin + t * way) >= sign * bound along an axis.
  void clip(double origin, double way, double bound, double sign);
};

/// Where a ray meets a triangle.
struct RayHit {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::uint32_t triangle = kNone;
  double depth = std::numeric_limits<double>::infinity();
  std::array<float, 3> weights{};  // Of the triangle's vertices.

  explicit operator bool() const { return triangle != kNone; }
};

struct RayHits {
  RayHit before;    // The first one before what is taken away; the first of all if nothing is.
  RayHit behind;    // The first one behind it.
  int winding = 0;  // How often the surface is round the place where the ray leaves what is taken away.
};

class SurfaceRaster {
 public:
  /// `points`: column, row and depth of each vertex; the ray of column c and row r goes through (c, r). `triangles` are
  /// counter-clockwise from outside where rows grow upwards. They aren't owned. `slack`: how far a hit may be on the
  /// wrong side of a stretch's end and still count as being at it: rounding.
  SurfaceRaster(std::vector<Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles, double slack);

  /// The hits of all rays of some rows, row by row. `away`: of each ray, the stretch that is taken away.
  std::vector<RayHits> hits(int columns, int row_begin, int row_end, std::span<const Stretch> away) const;

 private:
  std::vector<Vec3> points_;
  std::span<const std::array<std::uint32_t, 3>> triangles_;
  double slack_;
};

}  // namespace ccslice::cli
