// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/region_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Twice the signed area.
double area_2(const std::vector<Vec2>& points) {
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2 &a = points[i], &b = points[(i + 1) % points.size()];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

// Two unit squares side by side, the left one of region 3 and the right one of region 0.
std::vector<RegionEdge> two_squares() {
  return {{{0, 0}, {1, 0}, 3, kNoCellRegion},
          {{1, 0}, {2, 0}, 0, kNoCellRegion},
          {{2, 0}, {2, 1}, 0, kNoCellRegion},
          {{2, 1}, {1, 1}, 0, kNoCellRegion},
          {{1, 1}, {0, 1}, 3, kNoCellRegion},
          {{0, 1}, {0, 0}, 3, kNoCellRegion},
          {{1, 0}, {1, 1}, 3, 0}};
}

TEST(RegionLoops, GoRoundEachRegion) {
  const std::vector<RegionLoop> loops = join_region_loops(two_squares());
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].region, 0);
  EXPECT_EQ(loops[0].points, (std::vector<Vec2>{{1, 0}, {2, 0}, {2, 1}, {1, 1}}));
  EXPECT_EQ(loops[1].region, 3);
  EXPECT_EQ(loops[1].points, (std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
}

TEST(RegionLoops, AreTheSameWhateverTheOrderOfTheEdges) {
  std::vector<RegionEdge> edges = two_squares();
  const std::vector<RegionLoop> loops = join_region_loops(edges);
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    std::ranges::shuffle(edges, random);
    const std::vector<RegionLoop> again = join_region_loops(edges);
    ASSERT_EQ(again.size(), loops.size());
    for (std::size_t l = 0; l < loops.size(); ++l) EXPECT_EQ(again[l].points, loops[l].points);
  }
}

TEST(RegionLoops, RunClockwiseRoundWhatARegionLeavesOpen) {
  // A square of region 1 inside one of region 0.
  std::vector<RegionEdge> edges;
  const auto add_square = [&](double low, double high, std::uint8_t left, std::uint8_t right) {
    const std::vector<Vec2> corners = {{low, low}, {high, low}, {high, high}, {low, high}};
    for (std::size_t i = 0; i < 4; ++i) edges.push_back({corners[i], corners[(i + 1) % 4], left, right});
  };
  add_square(0, 3, 0, kNoCellRegion);
  add_square(1, 2, 1, 0);
  const std::vector<RegionLoop> loops = join_region_loops(edges);
  ASSERT_EQ(loops.size(), 3u);
  EXPECT_EQ(area_2(loops[0].points), 18);
  EXPECT_EQ(area_2(loops[1].points), -2);
  EXPECT_EQ(area_2(loops[2].points), 2);
  EXPECT_EQ(loops[2].region, 1);
}

// Four regions at a line, two of them by corners only: every edge belongs to loops that close.
TEST(RegionLoops, OfMeshesShareTheirArea) {
  for (const oracle::RegionMesh& given : oracle::region_meshes()) {
    SCOPED_TRACE(given.name);
    const auto solid = prepare_solid(given.mesh);
    const Box3 box = solid->summary().bounding_box;
    SlicePlane plane;
    plane.origin = Vec3(0, 0, box.center().z() + 0.013);
    const Contours contours = intersect(*solid, Placement::Identity(), plane, {});
    double whole = 0, parts = 0;
    for (const ContourLoop& loop : contours.loops) {
      std::vector<Vec2> points;
      for (const ContourPoint& point : loop.points) points.push_back(point.xy);
      whole += area_2(points);
    }
    for (const RegionLoop& loop : join_region_loops(contours.region_edges)) parts += area_2(loop.points);
    EXPECT_GT(whole, 0);
    EXPECT_NEAR(parts, whole, 1e-9 * whole);
  }
}

/// Twice the area in the contours of a mesh, in this plane.
double area_2(const ControlMesh& mesh, const SlicePlane& plane) {
  double area = 0;
  for (const ContourLoop& loop : intersect(*prepare_solid(mesh), Placement::Identity(), plane, {}).loops) {
    std::vector<Vec2> points;
    for (const ContourPoint& point : loop.points) points.push_back(point.xy);
    area += area_2(points);
  }
  return area;
}

// A row of cells of which the second one is inverted: the frames of its faces contradict those of their neighbours, in
// the middle of a region, beside an interface, or in a region of its own.
TEST(RegionLoops, CloseWhereCellsAreInverted) {
  ControlMesh row = oracle::box_mesh(6, 1, 1);
  for (Vec3& p : row.positions) p.x() = p.x() == 10 ? 20 : p.x() == 20 ? 10 : p.x();
  oracle::add_random_channels(row, 1, 3);
  row.allow_folds = true;
  SlicePlane plane;
  plane.origin = Vec3(0, 0, 5.013);
  for (const std::vector<double>& ends : {std::vector<double>{30}, {17}, {12}, {12, 17}}) {
    const auto region_at = [&](const Vec3& p) {
      return static_cast<int>(std::ranges::count_if(ends, [&](double end) { return p.x() > end; }));
    };
    const int count = static_cast<int>(ends.size()) + 1;
    const ControlMesh mesh = oracle::with_regions(row, count, region_at);
    const Contours contours = intersect(*prepare_solid(mesh), Placement::Identity(), plane, {});
    std::vector<double> areas(static_cast<std::size_t>(count));
    for (const RegionLoop& loop : join_region_loops(contours.region_edges)) areas[loop.region] += area_2(loop.points);
    for (int region = 0; region < count; ++region) {
      ControlMesh part = oracle::region_as_mesh(mesh, region);
      part.allow_folds = true;
      const double area = area_2(part, plane);
      EXPECT_NEAR(areas[static_cast<std::size_t>(region)], area, 1e-3 * std::abs(area)) << count << " " << region;
    }
  }
}

TEST(RegionLoops, ThatDoNotCloseAreAFault) {
  std::vector<RegionEdge> edges = two_squares();
  edges.pop_back();
  expect_error([&] { (void)join_region_loops(edges); }, ErrorCode::kInternal, "cell region 0 don't close");
  EXPECT_TRUE(join_region_loops({}).empty());
}

TEST(RegionLoops, CanBeCancelled) {
  const CancellationToken token = CancellationToken::make();
  token.cancel();
  expect_error([&] { (void)join_region_loops(two_squares(), token); }, ErrorCode::kCancelled, "");
}

}  // namespace
}  // namespace ccslice
