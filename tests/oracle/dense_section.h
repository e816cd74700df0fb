// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a plane cuts a surface, found by brute force: OpenSubdiv's surface sampled densely, a crossing solved on every
// edge of the sample grid whose ends lie on different sides, crossings joined by the quadrilaterals between them.

#pragma once

#include <vector>

#include "core/contour/contour.h"
#include "tests/support/bfr_surface.h"

namespace ccslice::oracle {

/// One connected piece of the section.
struct DenseLoop {
  struct Point {
    Vec2 xy;          // In the plane's coordinates.
    double sine = 1;  // Of the angle between surface and plane.
  };
  std::vector<Point> points;  // In no order.
  double width() const;       // The smaller side of its box.
};

class DenseSurface {
 public:
  DenseSurface(const BfrSurface& surface, int samples_a_side);

  std::vector<DenseLoop> section(const SlicePlane& plane) const;
  /// Heights above `normal` (a unit vector) at which something happens: where the surface is nearly level, most level
  /// first. Tops, bottoms and saddles.
  std::vector<double> critical_heights(const Vec3& normal, std::size_t most) const;

 private:
  std::size_t index(std::uint32_t face, int i, int j) const;

  const BfrSurface& surface_;
  int n_;
  std::vector<Vec3> points_, normals_;
};

}  // namespace ccslice::oracle
