// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_authoring/boundary_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/mesh/cell_complex.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(BoundaryDistance, IsTheDepthInABox) {
  const ControlMesh mesh = oracle::box_mesh(6, 5, 4);
  const std::vector<double> distances = distances_to_boundary(mesh);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const Vec3& p = mesh.positions[v];
    const double depth = std::min(p.minCoeff(), (Vec3(60, 50, 40) - p).minCoeff());
    EXPECT_NEAR(distances[v], depth, 1e-9) << p.transpose();
  }
}

/// Slowly, and by another road: the least distance from a fine lattice of points on the boundary's triangles.
double sampled_distance(const ControlMesh& mesh, const CellComplex& complex, const Vec3& point) {
  constexpr int kSteps = 40;
  double least = std::numeric_limits<double>::infinity();
  for (const FaceId face : complex.faces()) {
    if (!complex.face_on_boundary(face)) continue;
    const auto ring = complex.face_vertices(face);
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t v : ring) middle += mesh.positions[v] / static_cast<double>(ring.size());
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec3& a = mesh.positions[ring[i]];
      const Vec3& b = mesh.positions[ring[(i + 1) % ring.size()]];
      for (int s = 0; s <= kSteps; ++s) {
        for (int t = 0; s + t <= kSteps; ++t) {
          const Vec3 at = middle + (a - middle) * s / kSteps + (b - middle) * t / kSteps;
          least = std::min(least, (at - point).norm());
        }
      }
    }
  }
  return least;
}

TEST(BoundaryDistance, AgreesWithSamplesOnTheCatalogue) {
  int inside = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const CellComplex complex = make_cell_complex(mesh);
    const std::vector<double> distances = distances_to_boundary(mesh);
    for (const VertexId v : complex.vertices()) {
      if (complex.vertex_on_boundary(v)) {
        EXPECT_EQ(distances[v], 0) << name;
        continue;
      }
      if (v % 3 != 0) continue;
      ++inside;
      const double sampled = sampled_distance(mesh, complex, mesh.positions[v]);
      EXPECT_LE(distances[v], sampled + 1e-9) << name;
      EXPECT_GE(distances[v], sampled - 0.35) << name;  // The lattice's own spacing.
    }
  }
  EXPECT_GT(inside, 20);
}

}  // namespace
}  // namespace ccslice
