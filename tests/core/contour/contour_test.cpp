// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Hand-made hard cases of contours.

#include "core/contour/contour.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "core/contour/contour_tracer.h"
#include "core/limit/support.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;

std::shared_ptr<const LimitSolid> sharp_box(int nx, int ny, int nz, double size_mm, const oracle::KeepCell& keep = {}) {
  ControlMesh mesh = box_mesh(nx, ny, nz, size_mm, keep);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::sharpen_by_cells(mesh, 3);
  return prepare_solid(std::move(mesh));
}

Contours slice_at(const LimitSolid& solid, double z_mm, const ContourOptions& options = {}) {
  return intersect(solid, Placement::Identity(), horizontal_plane(z_mm), options);
}

double widest(const Contours& contours) {
  double width = 0;
  for (const ContourLoop& loop : contours.loops) {
    Eigen::AlignedBox2d box;
    for (const ContourPoint& point : loop.points) box.extend(point.xy);
    width = std::max(width, box.sizes().minCoeff());
  }
  return width;
}

TEST(Contour, APlaneAlongFacesCountsAsInfinitesimallyAbove) {
  for (const int n : {1, 2, 3}) {
    const auto box = sharp_box(n, n, n, 1.0 / n);
    const Contours bottom = slice_at(*box, 0);
    ASSERT_EQ(bottom.loops.size(), 1u);
    EXPECT_NEAR(signed_area(bottom), 1, 1e-9);
    EXPECT_TRUE(slice_at(*box, 1).loops.empty());
    EXPECT_TRUE(slice_at(*box, -1e-6).loops.empty());
    for (const double z : {1.0 / 3, 0.5, 2.0 / 3, 1 - 1e-7}) EXPECT_NEAR(signed_area(slice_at(*box, z)), 1, 1e-9) << z;
  }
}

TEST(Contour, PlanesAlongFacesOfARotatedPlacementCountAsInfinitesimallyAboveToo) {
  const auto box = sharp_box(2, 2, 2, 0.5);
  std::mt19937 random(3);
  for (int trial = 0; trial < 50; ++trial) {
    Placement placement = Placement::Identity();
    placement.linear() = Eigen::AngleAxisd(0.1 + trial, random_direction(random)).toRotationMatrix();
    placement.translation() = 50 * random_direction(random);
    for (const double z : {0.0, 0.5, 1.0}) {
      const SlicePlane plane{placement * Vec3(0, 0, z), placement.linear().col(0), placement.linear().col(1)};
      const Contours contours = intersect(*box, placement, plane, {});
      EXPECT_EQ(contours.loops.size(), z < 1 ? 1u : 0u) << "z " << z << ", trial " << trial;
      EXPECT_NEAR(signed_area(contours), z < 1 ? 1 : 0, 1e-9) << "z " << z << ", trial " << trial;
    }
  }
}

TEST(Contour, FacesWhereTheLiftedPlaneLiesCostNoMoreThanOthers) {
  const auto box = sharp_box(2, 2, 2, 10);
  const double lift = ContourIndex(*box, Placement::Identity(), Vec3::UnitZ()).lift_mm();
  for (const double share : {0.98, 0.99, 0.999, 1.0, 1.001, 1.01, 1.02}) {
    const Contours contours = slice_at(*box, 20 - share * lift, {.tolerance_mm = 1e-3, .smallest_feature_mm = 1e-3});
    EXPECT_LT(contours.leaves, 100u) << share;
    if (share > 1.015) {
      EXPECT_NEAR(signed_area(contours), 400, 1e-6);
    }
    if (share < 0.985) {
      EXPECT_TRUE(contours.loops.empty());
    }
  }
}

TEST(Contour, AStepInThePlaneGivesTheSolidJustAbove) {
  // Two cells below, one above the left one.
  const auto step = sharp_box(2, 1, 2, 1, [](int i, int, int k) { return k == 0 || i == 0; });
  EXPECT_NEAR(signed_area(slice_at(*step, 0)), 2, 1e-9);
  EXPECT_NEAR(signed_area(slice_at(*step, 1 - 1e-6)), 2, 1e-5);
  EXPECT_NEAR(signed_area(slice_at(*step, 1)), 1, 1e-9);
  EXPECT_NEAR(signed_area(slice_at(*step, 1.5)), 1, 1e-9);
  // Upside down: one below, two above.
  Placement flipped = Placement::Identity();
  flipped.linear() = Vec3(1, -1, -1).asDiagonal();
  EXPECT_NEAR(signed_area(intersect(*step, flipped, horizontal_plane(-1), {})), 2, 1e-9);
  EXPECT_NEAR(signed_area(intersect(*step, flipped, horizontal_plane(-1 - 1e-6), {})), 1, 1e-5);
}

TEST(Contour, PlanesThroughVerticesAndEdgesClose) {
  const auto box = sharp_box(2, 2, 2, 1);
  const double root2 = std::sqrt(2.0);
  // Through two opposite edges; through one edge only; through three corners; touching one corner.
  const Contours diagonal =
      intersect(*box, Placement::Identity(), plane_through(Vec3::Zero(), Vec3(1, -1, 0) / root2), {});
  EXPECT_NEAR(signed_area(diagonal), 4 * root2, 1e-6);
  const Vec3 up = Vec3(1, 1, 1).normalized();
  const Contours triangle = intersect(*box, Placement::Identity(), plane_through(Vec3(2, 0, 0), up), {});
  EXPECT_NEAR(signed_area(triangle), 2 * std::sqrt(3.0), 1e-6);
  const Contours hexagon = intersect(*box, Placement::Identity(), plane_through(Vec3(1, 1, 1), up), {});
  EXPECT_NEAR(signed_area(hexagon), 3 * std::sqrt(3.0), 1e-6);
  for (const Vec3& normal : {up, Vec3(-up), Vec3(Vec3(1, 1, 0) / root2), Vec3(Vec3(-1, -1, 0) / root2)}) {
    const Contours touching = intersect(*box, Placement::Identity(), plane_through(Vec3(2, 2, 2), normal), {});
    EXPECT_NEAR(signed_area(touching), 0, 1e-6);
  }
}

TEST(Contour, RingsHaveACounterClockwiseOutsideAndAClockwiseHole) {
  const auto ring = prepare_solid(make_ring());
  const Contours contours = slice_at(*ring, 8);
  ASSERT_EQ(contours.loops.size(), 2u);
  const double first = signed_area(contours.loops[0]), second = signed_area(contours.loops[1]);
  const double outer = std::max(first, second), inner = std::min(first, second);
  EXPECT_NEAR(outer, std::numbers::pi * 41.765 * 41.765, 2);
  EXPECT_NEAR(inner, -std::numbers::pi * 27.235 * 27.235, 2);
  EXPECT_EQ(contours.unresolved_leaves, 0u);
}

TEST(Contour, MirroredPlacementsKeepTheOrientation) {
  const auto solid = prepare_solid(oracle::tiny_mesh("frame_of_eight"));
  Placement mirrored = Placement::Identity();
  mirrored.linear()(0, 0) = -1;
  const Contours plain = slice_at(*solid, 5), flipped = intersect(*solid, mirrored, horizontal_plane(5), {});
  ASSERT_EQ(plain.loops.size(), 2u);
  EXPECT_GT(signed_area(plain), 0);
  EXPECT_NEAR(signed_area(plain), signed_area(flipped), 1e-9);
}

TEST(Contour, NoLoopWiderThanAVoxelIsLostUnderATop) {
  for (const char* name : {"single_hex", "box_3", "vertex_link_icosahedron", "tagged_corners", "cross_of_seven"}) {
    const auto solid = prepare_solid(oracle::tiny_mesh(name));
    std::mt19937 random(11);
    for (int trial = 0; trial < 8; ++trial) {
      Placement placement = Placement::Identity();
      placement.linear() = Eigen::AngleAxisd(trial, random_direction(random)).toRotationMatrix();
      const double top = bounding_box(*solid, placement).max().z();
      for (double depth = 1e-7; depth < 1; depth *= 3) {
        const SlicePlane plane = horizontal_plane(top - depth);
        const ContourOptions fine{.tolerance_mm = 1e-4, .smallest_feature_mm = 1e-3};
        const double width = widest(intersect(*solid, placement, plane, fine));
        for (const double voxel_mm : {0.02, 0.1, 0.5}) {
          if (width < voxel_mm) continue;
          const ContourOptions coarse{.tolerance_mm = 0.1, .smallest_feature_mm = voxel_mm};
          EXPECT_FALSE(intersect(*solid, placement, plane, coarse).loops.empty()) << name << ", depth " << depth;
        }
      }
    }
  }
}

TEST(Contour, LoopsPartAtSaddles) {
  // A U of three cells by two: two towers on a bridge. Between valley and tops there are two loops, below one.
  const auto towers = prepare_solid(box_mesh(3, 1, 2, 10, [](int i, int, int k) { return k == 0 || i != 1; }));
  const auto loops_at = [&](double z) { return slice_at(*towers, z).loops.size(); };
  double one = 2, two = 14;
  ASSERT_EQ(loops_at(one), 1u);
  ASSERT_EQ(loops_at(two), 2u);
  while (two - one > 1e-5) {
    const double middle = 0.5 * (one + two);
    (loops_at(middle) == 1 ? one : two) = middle;
  }
  const double valley = one;
  for (double step = 3e-5; step < 2; step *= 3) {
    EXPECT_EQ(loops_at(valley - step), 1u) << step;
    EXPECT_EQ(loops_at(valley + step), 2u) << step;
  }
  const double fine_area = signed_area(slice_at(*towers, valley, {.tolerance_mm = 1e-4, .smallest_feature_mm = 1e-3}));
  EXPECT_NEAR(signed_area(slice_at(*towers, valley)), fine_area, 0.1);
}

TEST(Contour, EveryPlaneThroughAFaceCornerIsSafe) {
  // Symmetric solids: faces' corners, sides and extrema lie in these planes together.
  std::size_t planes = 0;
  for (const auto& mesh :
       {box_mesh(1, 1, 1), box_mesh(3, 3, 1), oracle::fan_mesh(5, 1, 2), oracle::fan_mesh(3, 2, 2)}) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    const BoundarySurface surface(*solid);
    for (BoundaryFaceId face; face < surface.faces().size(); face += 3) {
      const Vec3 corner = evaluator.geo(surface.cell_param(face, 0, 0));
      for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(Vec3(1, 1, 1).normalized())}) {
        const SlicePlane plane = plane_through(corner, normal);
        const Contours exact = intersect(*solid, Placement::Identity(), plane, {});
        const ContourOptions fine{.tolerance_mm = 1e-4, .smallest_feature_mm = 0.01};
        EXPECT_NEAR(signed_area(exact), signed_area(intersect(*solid, Placement::Identity(), plane, fine)), 0.1);
        EXPECT_LT(largest_error_on_surface(*solid, Placement::Identity(), plane, exact), 1e-7);
        ++planes;
      }
    }
  }
  EXPECT_GT(planes, 300u);
}

TEST(Contour, ALayerDependsOnNothingBeforeIt) {
  const auto solid = prepare_solid(oracle::tiny_mesh("cross_of_seven"));
  const auto index = std::make_shared<const ContourIndex>(*solid, Placement::Identity(), Vec3::UnitZ());
  ContourTracer tracer(*solid, index);
  std::vector<Contours> upwards;
  for (int layer = 0; layer < 40; ++layer) upwards.push_back(tracer.trace(horizontal_plane(-1 + 0.8 * layer), {}));
  for (int layer = 39; layer >= 0; --layer) {
    const SlicePlane plane = horizontal_plane(-1 + 0.8 * layer);
    EXPECT_TRUE(same_bytes(tracer.trace(plane, {}), upwards[layer])) << layer;
    EXPECT_TRUE(same_bytes(intersect(*solid, Placement::Identity(), plane, {}), upwards[layer])) << layer;
  }
}

TEST(Contour, ATracerFollowsPlanesOfOtherNormals) {
  const auto solid = prepare_solid(oracle::tiny_mesh("cross_of_seven"));
  std::optional<ContourTracer> tracer;
  for (int turn = 0; turn < 12; ++turn) {
    // Back to the first one as well.
    const Placement placement(Eigen::AngleAxisd(0.4 * (turn % 5), Vec3(1, 2, 3).normalized()));
    const auto index = std::make_shared<const ContourIndex>(*solid, placement, Vec3::UnitZ());
    if (tracer) {
      tracer->follow(index);
    } else {
      tracer.emplace(*solid, index);
    }
    const SlicePlane plane = horizontal_plane(bounding_box(*solid, placement).center().z() + 0.7);
    const Contours fresh = intersect(*solid, placement, plane, {});
    EXPECT_FALSE(fresh.loops.empty()) << turn;
    EXPECT_TRUE(same_bytes(tracer->trace(plane, {}), fresh)) << turn;
  }
}

TEST(Contour, CancelsWhenAsked) {
  const auto solid = prepare_solid(box_mesh(2, 2, 2));
  ContourOptions options;
  options.cancel = CancellationToken::make();
  options.cancel.cancel();
  try {
    slice_at(*solid, 10, options);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

}  // namespace
}  // namespace ccslice
