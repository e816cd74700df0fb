// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours against OpenSubdiv's surface: points on it, polygons within the tolerance of it, no loop lost.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/contour/contour.h"
#include "tests/oracle/dense_section.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/slicing.h"
#include "tests/oracle/surface_view.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kBfrErrorMm = 2e-5;

Vec3 random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vec3(normal(random), normal(random), normal(random)).normalized();
}

/// The plane of all points p with normal . p = height.
SlicePlane plane_at(const Vec3& normal, double height) {
  SlicePlane plane;
  plane.x_axis = normal.unitOrthogonal();
  plane.y_axis = normal.cross(plane.x_axis);
  plane.origin = height * normal;
  return plane;
}

Vec3 in_space(const SlicePlane& plane, const Vec2& xy) {
  return plane.origin + xy.x() * plane.x_axis + xy.y() * plane.y_axis;
}

void expect_points_on_surface_and_plane(const Subject& subject, const SlicePlane& plane, const Contours& contours) {
  const BoundarySurface surface(subject.solid());
  LimitEvaluator evaluator(subject.solid());
  for (const ContourLoop& loop : contours.loops) {
    ASSERT_GE(loop.points.size(), 3u);
    for (const ContourPoint& point : loop.points) {
      const Vec3 on_surface = evaluator.geo(surface.cell_param(point.face, point.s, point.t));
      ASSERT_LT((on_surface - in_space(plane, point.xy)).norm(), 1e-7)
          << "face " << point.face << " " << point.s << " " << point.t;
    }
  }
}

double worst_distance_to_surface(const NearestOnSurface& nearest, const SlicePlane& plane, const Contours& contours,
                                 std::size_t most) {
  double worst = 0;
  std::size_t segments = 0;
  for (const ContourLoop& loop : contours.loops) segments += loop.points.size();
  const std::size_t stride = segments / most + 1;
  std::size_t number = 0;
  for (const ContourLoop& loop : contours.loops) {
    for (std::size_t i = 0; i < loop.points.size(); ++i) {
      if (number++ % stride != 0) continue;
      const Vec2 a = loop.points[i].xy, b = loop.points[(i + 1) % loop.points.size()].xy;
      for (const double t : {0.25, 0.5, 0.75})
        worst = std::max(worst, nearest.distance(in_space(plane, a + t * (b - a))));
    }
  }
  return worst;
}

/// Every piece of the section that is wider than the smallest feature must be followed by a contour. Their number.
std::size_t expect_no_loop_lost(const DenseSurface& dense, const SlicePlane& plane, const Contours& contours,
                                const ContourOptions& options) {
  const std::vector<Polygon> polygons = polygons_of(contours);
  std::size_t followed = 0;
  for (const DenseLoop& loop : dense.section(plane)) {
    if (loop.width() <= options.smallest_feature_mm) continue;
    ++followed;
    for (const DenseLoop::Point& point : loop.points) {
      const double allowed = (2 * options.tolerance_mm + kBfrErrorMm) / std::max(point.sine, 0.003) + 1e-4;
      EXPECT_LT(distance_to(polygons, point.xy), allowed)
          << "a loop " << loop.width() << " mm wide at " << point.xy.transpose() << ", sine " << point.sine
          << ", normal " << plane.x_axis.cross(plane.y_axis).transpose() << ", origin " << plane.origin.transpose();
    }
  }
  return followed;
}

class Contour : public testing::TestWithParam<std::size_t> {};

TEST_P(Contour, PolygonsLieWithinTheToleranceOfTheSurface) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const SurfaceView view(subject);
  const NearestOnSurface nearest(view.surface(), 8);
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  const Box3 box = subject.solid().summary().bounding_box;
  std::uniform_real_distribution<double> unit(0.1, 0.9);
  for (const double tolerance : {1e-3, 1e-1}) {
    const Vec3 normal = random_unit(random);
    const Vec3 through = box.min() + box.sizes().cwiseProduct(Vec3(unit(random), unit(random), unit(random)));
    const SlicePlane plane = plane_at(normal, normal.dot(through));
    ContourOptions options;
    options.tolerance_mm = tolerance;
    const Contours contours = intersect(subject.solid(), Placement::Identity(), plane, options);
    expect_points_on_surface_and_plane(subject, plane, contours);
    EXPECT_LT(worst_distance_to_surface(nearest, plane, contours, 150), tolerance + kBfrErrorMm);
  }
}

TEST_P(Contour, LosesNoLoopAtTopsAndSaddles) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const SurfaceView view(subject);
  const DenseSurface dense(view.surface(), subject.control().cell_count() > 20 ? 12 : 24);
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  ContourOptions options;
  options.smallest_feature_mm = 0.05;
  std::size_t followed = 0;
  for (const Vec3& normal : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitX()), random_unit(random)}) {
    for (const double height : dense.critical_heights(normal, 6)) {
      for (const double offset : {-0.02, -2e-4, 2e-4, 0.02}) {
        const SlicePlane plane = plane_at(normal, height + offset);
        const Contours contours = intersect(subject.solid(), Placement::Identity(), plane, options);
        followed += expect_no_loop_lost(dense, plane, contours, options);
      }
    }
  }
  EXPECT_GE(followed, 4u);
}

TEST_P(Contour, WindsOnceRoundPointsInsideAndNeverRoundPointsOutside) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  if (subject.solid().summary().folding_cells > 0) GTEST_SKIP() << "the limit folds";
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 30; ++i) {
    const Vec3 normal = random_unit(random);
    const CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % subject.solid().cell_count())},
                       Vec3(unit(random), unit(random), unit(random))};
    const Vec3 inside = evaluator.geo(at);
    SlicePlane plane = plane_at(normal, 0);
    plane.origin = inside;
    const std::vector<Polygon> polygons = polygons_of(intersect(subject.solid(), Placement::Identity(), plane, {}));
    if (distance_to(polygons, Vec2::Zero()) > 0.01) {
      EXPECT_EQ(winding_number(polygons, Vec2::Zero()), 1) << to_text(at);
    }
    EXPECT_EQ(winding_number(polygons, Vec2(2 * subject.diagonal_mm(), 0)), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, Contour, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

double area(const Contours& contours) {
  double twice = 0;
  for (const Polygon& polygon : polygons_of(contours)) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      twice += a.x() * b.y() - a.y() * b.x();
    }
  }
  return twice / 2;
}

TEST(ContourPlane, ThroughVerticesOrAlongFacesCountsAsInfinitesimallyAbove) {
  ControlMesh step = box_mesh(2, 1, 2, 10, [](int i, int, int k) { return i == 0 || k == 0; });
  sharpen_by_cells(step, 1);
  sharpen_by_cells(step, 3);
  add_random_channels(step, 1, 1);
  const Subject subject(step);
  const auto area_at = [&](const Vec3& normal, double height) {
    return area(intersect(subject.solid(), Placement::Identity(), plane_at(normal, height), {}));
  };
  EXPECT_NEAR(area_at(Vec3::UnitZ(), 0), 200, 1e-6) << "along the bottom";
  EXPECT_NEAR(area_at(Vec3::UnitZ(), 5), 200, 1e-6);
  EXPECT_NEAR(area_at(Vec3::UnitZ(), 10), 100, 1e-6) << "along the step";
  EXPECT_NEAR(area_at(Vec3::UnitZ(), 20), 0, 1e-6) << "along the top";
  EXPECT_NEAR(area_at(-Vec3::UnitZ(), -20), 100, 1e-6) << "from above, along the top";
  EXPECT_NEAR(area_at(-Vec3::UnitZ(), -10), 200, 1e-6) << "from above, along the step";
  EXPECT_NEAR(area_at(Vec3::UnitX(), 10), 100, 1e-6) << "along the wall of the step";
  EXPECT_NEAR(area_at(Vec3::UnitY(), 0), 300, 1e-6);
  EXPECT_NEAR(area_at(Vec3(1, 0, 1).normalized(), 0), 0, 1e-6) << "through an edge";
}

class RealContour : public testing::TestWithParam<std::string> {};

TEST_P(RealContour, PolygonsLieWithinTheToleranceAndNoLoopIsLost) {
  const auto mesh = read_real_mesh_ungraded(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const Subject subject(*mesh);
  const SurfaceView view(subject);
  const NearestOnSurface nearest(view.surface(), 12);
  const DenseSurface dense(view.surface(), 4);
  std::mt19937 random(7);
  for (const Vec3& normal : {Vec3(Vec3::UnitZ()), random_unit(random)}) {
    const double middle = normal.dot(subject.solid().summary().bounding_box.center());
    const SlicePlane plane = plane_at(normal, middle + 0.01 * subject.diagonal_mm());
    ContourOptions options;
    options.smallest_feature_mm = 0.05;
    const Contours contours = intersect(subject.solid(), Placement::Identity(), plane, options);
    EXPECT_GT(contours.loops.size(), 0u);
    expect_points_on_surface_and_plane(subject, plane, contours);
    EXPECT_LT(worst_distance_to_surface(nearest, plane, contours, 600), options.tolerance_mm + kBfrErrorMm);
    EXPECT_GT(expect_no_loop_lost(dense, plane, contours, options), 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Samples, RealContour, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, RealContour, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealContour, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, RealContour, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
