// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which triangles can be the nearest in a cube, and bounds of the distance there.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/distance/float_points.h"
#include "core/distance/triangle_tree.h"

namespace ccslice {

/// Throws Error{kCancelled}, but never parks its thread meanwhile, as CancellationToken::throw_if_cancelled() may:
/// threads that wait for what this one makes for all would keep it parked.
void throw_if_cancelled_in_place(const CancellationToken& cancel);

struct DistanceCube {
  Vec3 middle = Vec3::Zero();  // mm.
  double half = 0;             // Half an edge.

  DistanceCube child(unsigned number) const;  // Bit a of the number: the upper half along axis a.
  FloatBox box() const;
  double radius() const;  // From the middle to a corner.
};

/// n x - d(x) lies between two numbers everywhere in a cube, d being the distance and n a unit vector.
struct DistanceSlab {
  FloatPoint n = {};
  float least = 0, most = 0;
};

/// The place of these groups' triangles that is nearest to the point.
Vec3 nearest_place(const TriangleTree& triangles, std::span<const std::uint32_t> groups, const Vec3& point);

/// The candidates that may be the nearest somewhere in the cube. A group can't if it is farther than y, the place
/// nearest to the middle, from every corner: its squared distance is |x|^2 plus the least of the functions
/// |z|^2 - 2 x z over its places z, so minus |x - y|^2 it is concave, and positive in the cube if it is at the corners.
/// The same goes for its box, which is looked at first, and alone unless `by_triangles`. `nearest`: to the middle; it
/// comes first. `rounding_mm`: more than distances lose to it.
std::vector<std::uint32_t> nearest_somewhere(const TriangleTree& triangles, const DistanceCube& cube,
                                             std::span<const std::uint32_t> candidates, std::uint32_t nearest,
                                             bool by_triangles, double rounding_mm);

/// `groups`: those of nearest_somewhere(). n x - d(x) is at most the greatest n z over places z of the triangles that
/// may be the nearest, as d(x) = |x - z| >= n (x - z). And with e = x - m from the middle m of an eighth of the cube,
/// where the distance is d, in the direction u from the nearest place, d(x) <= |d u + e| <= d + u e + e^2 / 2d.
DistanceSlab slab_of(const TriangleTree& triangles, const DistanceCube& cube, std::span<const std::uint32_t> groups,
                     double rounding_mm);

}  // namespace ccslice
