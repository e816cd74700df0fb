// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours of every tiny mesh under random planes and placements (seeded), against the limit evaluator and against the
// volume that the triangles enclose.

#include <gtest/gtest.h>

#include "core/contour/contour.h"
#include "core/limit/support.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

class ContourConsistency : public testing::TestWithParam<oracle::TinyMesh> {
 protected:
  std::shared_ptr<const LimitSolid> solid_ = prepare_solid(GetParam().mesh);
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
    const Box3 box = bounding_box(*solid_, placement);
    const SlicePlane plane = random_plane(random, box);
    const ContourOptions options{.tolerance_mm = trial % 2 == 0 ? 1e-3 : 1e-2, .smallest_feature_mm = 0.03};
    const Contours contours = intersect(*solid_, placement, plane, options);
    EXPECT_LT(largest_error_on_surface(*solid_, placement, plane, contours), 1e-8 * box.diagonal().norm());
    for (const ContourLoop& loop : contours.loops) EXPECT_GE(loop.points.size(), 3u);
  }
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

TEST_P(ContourConsistency, TrianglesClose) {
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
