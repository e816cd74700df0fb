// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The divergence theorem for polyhedra: a volume is the sum of the signed volumes of the cones from one point to its
// faces, whose corners go round outward.

#pragma once

#include <cstddef>
#include <span>

#include "core/base/types.h"

namespace ccslice {

/// Six times the volume between the origin and a face. `ring`: its three or four corners.
inline double six_cones(std::span<const Vec3> ring) {
  const auto cone = [&](std::size_t i, std::size_t j, std::size_t k) { return ring[i].dot(ring[j].cross(ring[k])); };
  if (ring.size() == 3) return cone(0, 1, 2);
  // Bilinear: the mean of the two ways to halve it.
  return (cone(0, 1, 2) + cone(0, 2, 3) + cone(0, 1, 3) + cone(1, 2, 3)) / 2;
}

}  // namespace ccslice
