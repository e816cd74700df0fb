// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points that lie in one place: CLUSTERS are the connected components of the graph whose edges are all pairs of points
// within a distance of each other. So they are the same whatever the order of points, and a chain of points each of
// which is near the next is one cluster, however long it is.
//
// Points are hashed into the cubes of a grid, whose sides are several distances long; a point beside the wall of a cube
// goes into the cube beyond, too. Two points within the distance then have a cube in common. What a cube holds is
// halved until each box is smaller than the distance, so its points are one cluster without a look at any pair. So a
// million points in one place, or in a plane, take as long as a million points anywhere.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice {

/// Points in one place.
struct PointCluster {
  std::vector<std::uint32_t> points;  // Ascending, at least two.
  Box3 box;                           // Of the points.
  /// The longest distance between two of them; of clusters of more than 64 points the diagonal of their box, which is
  /// no less.
  double length = 0;
};

/// Every cluster of more than one point, by first point. Points that aren't finite are in none.
/// REQUIRES: 0 <= distance; fewer than 2^32 points.
std::vector<PointCluster> find_point_clusters(std::span<const Vec3> points, double distance);

}  // namespace ccslice
