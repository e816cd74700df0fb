// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points of the limit surface by the evaluator of the volume, which contours don't use, and the meshes that the tests
// of their parts look at.

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>

#include "core/contour/bezier_net.h"
#include "core/limit/boundary_surface.h"
#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {

/// Round, concave and sharp ones; with irregular vertices on the surface and below it, and faces of several sizes.
inline constexpr std::array kSurfaceMeshes = {"box_3",
                                              "cross_of_seven",
                                              "edge_valence_5_inside",
                                              "edge_valence_3_meets_corner",
                                              "vertex_link_icosahedron",
                                              "concave_corner",
                                              "sharp_cross",
                                              "sharp_hex_wedge_tet"};

/// A solid's surface in rotated and moved coordinates.
class SurfacePoints {
 public:
  SurfacePoints(const ControlMesh& mesh, std::uint32_t seed)
      : solid_(prepare_solid(mesh)), surface(*solid_), evaluator_(*solid_) {
    std::mt19937 random(seed);
    const SlicePlane plane = plane_through(Vec3::Zero(), random_direction(random));
    axes.linear.row(0) = plane.x_axis;
    axes.linear.row(1) = plane.y_axis;
    axes.linear.row(2) = plane.x_axis.cross(plane.y_axis);
    axes.offset = 10 * random_direction(random);
  }

  /// Along the axes.
  Vec3 at(BoundaryFaceId face, double s, double t) { return axes(evaluator_.geo(surface.cell_param(face, s, t))); }
  Vec3 at_vertex(BoundaryFaceId face, std::uint32_t s, std::uint32_t t) {
    return at(face, s / double{kSurfaceOne}, t / double{kSurfaceOne});
  }
  double height(BoundaryFaceId face, double s, double t) { return at(face, s, t).z(); }

  /// Of some points.
  std::pair<double, double> heights() {
    const double first = height(BoundaryFaceId{0}, 0, 0);
    std::pair range(first, first);
    for (const BoundaryFaceId face : surface.face_ids()) {
      for (int k = 0; k < 9; ++k) {
        const double z = height(face, 0.5 * (k % 3), 0.5 * (k / 3));
        range = {std::min(range.first, z), std::max(range.second, z)};
      }
    }
    return range;
  }

 private:
  std::shared_ptr<const LimitSolid> solid_;

 public:
  BoundarySurface surface;
  AffineMap axes;

 private:
  LimitEvaluator evaluator_;
};

}  // namespace ccslice
