// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the tests of contours and triangles measure.

#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include "core/contour/contour.h"
#include "core/contour/tessellate.h"
#include "core/limit/limit_evaluator.h"

namespace ccslice {

/// Positive round material, negative round holes. mm^2.
double signed_area(const ContourLoop& loop);
double signed_area(const Contours& contours);

/// The point of the plane that a contour point names, world mm.
Vec3 world_point(const SlicePlane& plane, const Vec2& xy);

/// Largest distance between where contour points say they are and the limit surface at their parameters, world mm.
double largest_error_on_surface(const LimitSolid& solid, const Placement& placement, const SlicePlane& plane,
                                const Contours& contours);

/// Through `point`, with the given unit normal and axes of no particular direction.
SlicePlane plane_through(const Vec3& point, const Vec3& normal);
SlicePlane horizontal_plane(double z_mm);

Vec3 random_direction(std::mt19937& random);
/// Rotation, shear, scaling by 0.3 to 3, translation; mirrored half of the time.
Placement random_placement(std::mt19937& random);

/// The signed volume under the contours of `layers` parallel planes across the placed solid (midpoint rule), mm^3.
double volume_of_layers(const LimitSolid& solid, const Placement& placement, const Vec3& normal, int layers,
                        const ContourOptions& options);

/// All chunks of a tessellation in one.
struct Triangulation {
  TessellationChunk all;
  TessellationSummary summary;
  std::size_t chunks = 0;
};
Triangulation triangulate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options);
double signed_volume(const TessellationChunk& triangles);
/// Directed edges that don't occur exactly once, or whose reverse doesn't.
std::size_t unmatched_edges(const TessellationChunk& triangles);
/// Edges, whatever their direction, that don't have exactly two triangles.
std::size_t open_edges(const TessellationChunk& triangles);

bool same_bytes(const Contours& a, const Contours& b);

}  // namespace ccslice
