// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Normals to shade a triangulated surface with: smooth where the surface is, and broken at its edges.
//
// At a vertex a triangle takes the mean of the normals of the triangles round it, weighted by their areas, but of those
// alone that are within an angle of its own, kCreaseDeg unless it is said. Neighbours on a smooth patch are closer than
// that if the triangles are within a small part of a picture's place of it; the two sides of a sharp edge are not.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice::cli {

class SurfaceNormals {
 public:
  static constexpr double kCreaseDeg = 20;

  /// `triangles` aren't owned.
  SurfaceNormals(std::span<const std::array<double, 3>> points, std::span<const std::array<std::uint32_t, 3>> triangles,
                 double crease_deg = kCreaseDeg);

  /// Outwards, of length 1, at a place of a triangle that has these weights of its vertices. 0 if the triangle has no
  /// area.
  Vec3 at(std::uint32_t triangle, const std::array<float, 3>& weights) const;

 private:
  Vec3 at_vertex(std::uint32_t triangle, std::uint32_t vertex) const;

  std::span<const std::array<std::uint32_t, 3>> triangles_;
  double least_cosine_;                                     // Of normals that are taken together.
  std::vector<Vec3> areas_;                                 // By triangle: its normal, as long as twice its area.
  std::vector<std::uint32_t> first_of_vertex_, of_vertex_;  // The triangles at a vertex.
};

}  // namespace ccslice::cli
