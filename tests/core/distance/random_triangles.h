// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Triangles anywhere, and the distance from them by a method of its own: in doubles, by regions of the triangle's
// plane [Ericson, Real-Time Collision Detection, 5.1.5].

#pragma once

#include <random>
#include <vector>

#include "core/base/types.h"
#include "core/distance/float_points.h"

namespace ccslice {

/// In a cube of 10 mm, so large as `size`, some of them flat to a line or a point, or nearly so.
std::vector<FloatTriangle> random_triangles(std::mt19937& random, std::size_t count, double size);

Vec3 exact_nearest_place(const FloatTriangle& triangle, const Vec3& point);
double exact_distance(const std::vector<FloatTriangle>& triangles, const Vec3& point);

Vec3 random_point(std::mt19937& random, double low, double high);

}  // namespace ccslice
