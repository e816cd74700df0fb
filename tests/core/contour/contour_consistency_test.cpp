// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours of every tiny mesh under random planes and placements (seeded), against OpenSubdiv's surface and against the
// volume that the triangles enclose.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/contour/contour.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/bfr_surface.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

class ContourConsistency : public testing::TestWithParam<oracle::TinyMesh> {
 protected:
  std::shared_ptr<const LimitSolid> solid_ = LimitSolid::prepare(GetParam().mesh);
};

/// A random plane through a random point of the placed box.
SlicePlane random_plane(std::mt19937& random, const Box3& box) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Vec3 share(unit(random), unit(random), unit(random));
  return plane_through(box.min() + share.cwiseProduct(box.sizes()), random_direction(random));
}

TEST_P(ContourConsistency, PointsLieOnTheLimitSurfaceAndInThePlane) {
  std::mt19937 random(20261121);
  for (int trial = 0; trial < 20; ++trial) {
    const Placement placement = trial % 4 == 0 ? Placement::Identity() : random_placement(random);
    const Box3 box = solid_->placed_bounding_box(placement);
    const SlicePlane plane = random_plane(random, box);
    const ContourOptions options{.tolerance_mm = trial % 2 == 0 ? 1e-3 : 1e-2, .smallest_feature_mm = 0.03};
    const Contours contours = intersect(*solid_, placement, plane, options);
    EXPECT_LT(largest_error_on_surface(*solid_, placement, plane, contours), 1e-8 * box.diagonal().norm());
    for (const ContourLoop& loop : contours.loops) EXPECT_GE(loop.points.size(), 3u);
  }
}

TEST_P(ContourConsistency, PolygonsLieWithinTheToleranceOfOpenSubdivsSurface) {
  oracle::BruteMesh mesh = oracle::to_brute_mesh(GetParam().mesh);
  oracle::BruteTopology topology = oracle::build_topology(mesh.cells, mesh.vertex_count());
  if (std::ranges::any_of(mesh.cells, [](const oracle::BruteCell& cell) { return cell.kind != CellKind::kHex; })) {
    mesh = oracle::refine(mesh, topology).mesh;
    topology = oracle::build_topology(mesh.cells, mesh.vertex_count());
  }
  const oracle::BfrSurface surface(mesh, topology);
  const oracle::NearestOnSurface nearest(surface, 16);
  std::mt19937 random(20261122);
  double worst = 0;
  for (int trial = 0; trial < 4; ++trial) {
    const SlicePlane plane = random_plane(random, solid_->placed_bounding_box(Placement::Identity()));
    const ContourOptions options{.tolerance_mm = 1e-3, .smallest_feature_mm = 0.03};
    for (const ContourLoop& loop : intersect(*solid_, Placement::Identity(), plane, options).loops) {
      for (std::size_t k = 0; k < loop.points.size(); k += 3) {
        const Vec2 &p = loop.points[k].xy, &q = loop.points[(k + 1) % loop.points.size()].xy;
        for (const double u : {0.25, 0.5}) {
          worst = std::max(worst, nearest.distance(world_point(plane, (1 - u) * p + u * q)));
        }
      }
    }
  }
  EXPECT_LE(worst, 1e-3);
  RecordProperty("worst_mm", std::to_string(worst));
}

TEST_P(ContourConsistency, LayersAddUpToTheVolumeThatTheTrianglesEnclose) {
  std::mt19937 random(20261123);
  const Placement placement = random_placement(random);
  const Triangulation triangles = triangulate(*solid_, placement, {.tolerance_mm = 0.01});
  const double volume = signed_volume(triangles.all);
  EXPECT_GT(volume, 0);
  const ContourOptions options{.tolerance_mm = 0.01, .smallest_feature_mm = 0.1};
  EXPECT_NEAR(volume_of_layers(*solid_, placement, random_direction(random), 80, options), volume, 5e-3 * volume);
}

TEST_P(ContourConsistency, TrianglesCloseAndLieWithinTheTolerance) {
  std::mt19937 random(20261124);
  for (const double tolerance_mm : {0.3, 0.04}) {
    const Placement placement = random_placement(random);
    const Triangulation triangles = triangulate(*solid_, placement, {.tolerance_mm = tolerance_mm});
    EXPECT_EQ(unmatched_edges(triangles.all), 0u);
    EXPECT_EQ(triangles.summary.vertices, triangles.all.positions.size());
    EXPECT_EQ(triangles.summary.triangles, triangles.all.triangles.size());
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, ContourConsistency, testing::ValuesIn(oracle::tiny_meshes()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace ccslice
