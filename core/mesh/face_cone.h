// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The divergence theorem for polyhedra: a volume is the sum of the signed volumes of the cones from one point to its
// faces, whose corners go round outward.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/types.h"
#include "core/mesh/cell_kind.h"

namespace ccslice {

/// Six times the volume between the origin and a face. `ring`: its three or four corners.
inline double six_cones(std::span<const Vec3> ring) {
  const auto cone = [&](std::size_t i, std::size_t j, std::size_t k) { return ring[i].dot(ring[j].cross(ring[k])); };
  if (ring.size() == 3) return cone(0, 1, 2);
  // Bilinear: the mean of the two ways to halve it.
  return (cone(0, 1, 2) + cone(0, 2, 3) + cone(0, 1, 3) + cone(1, 2, 3)) / 2;
}

/// The volume between a cell's bilinear faces; negative if it is inside out. `corners`: in VTK order. `place(corner)`:
/// where one is.
template <typename Place>
double cell_volume(CellKind kind, std::span<const std::uint32_t> corners, const Place& place) {
  const Vec3 origin = place(corners[0]);
  double six_volumes = 0;
  for (const LocalFace& face : cell_topology(kind).faces) {
    std::array<Vec3, 4> ring;
    for (std::size_t i = 0; i < face.size; ++i) {
      const std::uint8_t local = face.corners[i];
      ring[i] = place(corners[kind == CellKind::kHex ? vtk_to_bits(local) : local]) - origin;
    }
    six_volumes += six_cones(std::span(ring).first(face.size));
  }
  return six_volumes / 6;
}

}  // namespace ccslice
