// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The winding number of a closed surface round a point in space: its triangles' solid angles by 4 pi, 1 inside and 0
// outside [Jacobson, Kavan, Sorkine-Hornung 2013]. The angle of one triangle is that of [Van Oosterom, Strackee 1983].

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/types.h"
#include "tests/support/bfr_surface.h"

namespace ccslice::oracle {

/// Steradians, positive if the point sees the triangle's back, which the corners go round clockwise.
double solid_angle(const Vec3& point, const Vec3& a, const Vec3& b, const Vec3& c);

/// A BfrSurface as samples^2 quads a face. Far away from a point, quads of a face count together: two triangles stand
/// for a square of them that is seen from more than twice its box's diagonal.
class SurfaceWinding {
 public:
  /// REQUIRES: samples is a power of two.
  SurfaceWinding(const BfrSurface& surface, int samples);

  /// About 1 inside and 0 outside; a point nearer to the surface than its quads are may be on either side.
  double number_at(const Vec3& point) const;

 private:
  struct Square {
    std::uint32_t face = 0;
    int i = 0, j = 0, size = 0;
  };
  const Vec3& sample(std::uint32_t face, int i, int j) const {
    return samples_[(std::size_t{face} * (count_ + 1) + i) * (count_ + 1) + j];
  }
  /// Adds the square's box, and those within it, in the order in which angle_of() meets them.
  Box3 add_boxes(const Square& square);
  double angle_of(const Square& square, const Vec3& point, std::size_t& box) const;

  int count_;
  std::size_t faces_;
  std::vector<Vec3> samples_;
  std::vector<Box3> boxes_;
  std::vector<std::size_t> boxes_within_;  // How many boxes follow that lie within one.
};

}  // namespace ccslice::oracle
