// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/surface_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "client/cli/pictures/surface_normals.h"

namespace ccslice::cli {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr int kRasterSide = 40;

struct Ball {
  std::vector<Vec3> points;
  Triangles triangles;  // Counter-clockwise from outside where rows grow upwards.
};

/// An octahedron, halved again and again, round (centre, centre, 0).
Ball ball(double radius, double centre, int halvings) {
  std::vector<Vec3> points = {Vec3::UnitX(),  -Vec3::UnitX(), Vec3::UnitY(),
                              -Vec3::UnitY(), Vec3::UnitZ(),  -Vec3::UnitZ()};
  Triangles triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int i = 0; i < halvings; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (is_new) points.push_back((points[a] + points[b]).normalized());
      return at->second;
    };
    Triangles finer;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = finer;
  }
  for (Vec3& point : points) point = radius * point + Vec3(centre, centre, 0);
  return {points, triangles};
}

/// To columns, rows that grow downwards, and depths.
std::vector<Vec3> projected(const Ball& ball) {
  std::vector<Vec3> points;
  for (const Vec3& p : ball.points) points.emplace_back(p.x(), kRasterSide - 1 - p.y(), -p.z());
  return points;
}

std::vector<RayHits> hits(const Ball& ball, const Stretch& away) {
  return SurfaceRaster(projected(ball), ball.triangles, 1e-9)
      .hits(kRasterSide, 0, kRasterSide, std::vector<Stretch>(std::size_t{kRasterSide} * kRasterSide, away));
}

TEST(SurfaceRaster, FindsTheFrontOfABall) {
  const double radius = 12.3, centre = 19.2;
  const std::vector<RayHits> rays = hits(ball(radius, centre, 5), {.first = 0, .last = 0});
  for (int row = 0; row < kRasterSide; ++row) {
    for (int column = 0; column < kRasterSide; ++column) {
      const RayHit& hit = rays[static_cast<std::size_t>(kRasterSide * row + column)].before;
      const double distance = std::hypot(column - centre, kRasterSide - 1 - row - centre);
      if (std::abs(distance - radius) < 0.3) continue;
      ASSERT_EQ(static_cast<bool>(hit), distance < radius) << column << " " << row;
      if (!hit) continue;
      EXPECT_NEAR(hit.depth, -std::sqrt(radius * radius - distance * distance), 0.3);
    }
  }
}

TEST(SurfaceRaster, KnowsWhatIsInsideBetweenTrianglesToo) {
  // Vertices and edges right on rays, and everywhere else.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(17, 22);
  for (int trial = 0; trial < 40; ++trial) {
    const double radius = trial % 2 == 0 ? 8 : place(random) / 2,
                 centre = trial % 2 == 0 ? 19 + trial % 3 : place(random);
    for (const RayHits& ray : hits(ball(radius, centre, trial % 4), {.first = -1000, .last = 1000})) {
      ASSERT_EQ(ray.winding, 0) << radius << " " << centre;
      ASSERT_FALSE(ray.before);
      ASSERT_FALSE(ray.behind);
    }
    int inside = 0;
    for (const RayHits& ray : hits(ball(radius, centre, trial % 4), {.first = -1000, .last = 0.123})) {
      ASSERT_TRUE(ray.winding == 0 || ray.winding == 1) << radius << " " << centre;
      ASSERT_EQ(ray.winding == 1, static_cast<bool>(ray.behind)) << "what is entered is left again";
      inside += ray.winding;
    }
    EXPECT_GT(inside, radius * radius);
  }
}

TEST(SurfaceRaster, CountsAFaceAtTheEndOfAStretchAsThere) {
  // A box from depth -5 to 5 about the ray's middle.
  Ball box;
  for (int corner = 0; corner < 8; ++corner) {
    box.points.emplace_back(corner & 1 ? 30.5 : 9.5, corner & 2 ? 30.5 : 9.5, corner & 4 ? 5 : -5);
  }
  box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  const std::size_t middle = kRasterSide * 20 + 20;
  for (const double error : {-1e-12, 0.0, 1e-12}) {
    const RayHits front = hits(box, {.first = -100, .last = -5 + error})[middle];
    EXPECT_EQ(front.winding, 0) << "the face is what remains";
    EXPECT_NEAR(front.behind.depth, -5, 1e-9);
    const RayHits back = hits(box, {.first = -100, .last = 5 + error})[middle];
    EXPECT_EQ(back.winding, 0) << "nothing remains";
    EXPECT_FALSE(back.behind);
  }
}

TEST(SurfaceNormals, AreSmoothOnABallAndBrokenAtEdges) {
  const Ball round = ball(3, 0, 5), sharp = ball(3, 0, 0);
  for (const Ball* shape : {&round, &sharp}) {
    std::vector<std::array<double, 3>> points;
    for (const Vec3& p : shape->points) points.push_back({p.x(), p.y(), p.z()});
    const SurfaceNormals normals(points, shape->triangles);
    for (std::uint32_t t = 0; t < shape->triangles.size(); ++t) {
      const auto& [a, b, c] = shape->triangles[t];
      const Vec3 corner = shape->points[a],
                 flat = (shape->points[b] - corner).cross(shape->points[c] - corner).normalized();
      const Vec3 there = normals.at(t, {1, 0, 0});
      EXPECT_GT(there.dot(shape == &round ? Vec3(corner.normalized()) : flat), 0.9999)
          << "an octahedron's faces are flat up to their edges";
    }
  }
}

}  // namespace
}  // namespace ccslice::cli
