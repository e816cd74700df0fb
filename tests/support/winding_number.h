// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The winding number of closed polygons round a point, as the paper tests every voxel [Luu19, 3.2.1]: for each edge, is
// it an upward crossing with the point on its left (+1), or a downward crossing with the point on its right (-1)?

#pragma once

#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice::oracle {

/// Closed: the last point joins the first. Not empty.
using Polygon = std::vector<Vec2>;

int winding_number(std::span<const Polygon> polygons, const Vec2& point);

/// Distance from a point to the nearest polygon edge; infinite without polygons.
double distance_to(std::span<const Polygon> polygons, const Vec2& point);

}  // namespace ccslice::oracle
