// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/voxel_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

namespace ccslice::cli {
namespace {

VoxelBlock block_of(int size, const std::function<bool(const Vec3&)>& inside) {
  VoxelBlock block;
  block.size = {size, size, size};
  block.origin_mm = Vec3(10, 20, 30);
  block.pitch_mm = Vec3(0.5, 1, 2);
  for (int z = 0; z < size; ++z) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) block.inside.push_back(inside(Vec3(x, y, z)) ? 1 : 0);
    }
  }
  return block;
}

/// By the divergence theorem; positive if triangles are counter-clockwise from outside.
double volume(const client::Surface& surface) {
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto point = [&](std::uint32_t vertex) { return Vec3(surface.points_mm[vertex].data()); };
    sum += point(a).dot(point(b).cross(point(c))) / 6;
  }
  return sum;
}

bool is_closed(const client::Surface& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& [a, b, c] : surface.triangles) {
    for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
      from < to ? ++edges[{from, to}] : --edges[{to, from}];
    }
  }
  for (const auto& [edge, count] : edges) {
    if (count != 0) return false;
  }
  return !edges.empty();
}

TEST(VoxelSurface, OfABallIsClosedAndHasItsVolume) {
  const client::Surface ball =
      voxel_surface(block_of(40, [](const Vec3& p) { return (p - Vec3::Constant(19.5)).norm() < 15; }));
  EXPECT_TRUE(is_closed(ball));
  EXPECT_NEAR(volume(ball) / (4.0 / 3 * std::numbers::pi * 15 * 15 * 15), 1, 0.03) << "a voxel has 1 mm^3";
  Box3 box;
  for (const auto& point : ball.points_mm) box.extend(Vec3(point.data()));
  EXPECT_LT((box.center() - Vec3(20, 40, 70)).norm(), 1e-9);
}

TEST(VoxelSurface, IsClosedAtTheBlocksEndsAndWhereVoxelsTouchInEdgesAndCorners) {
  EXPECT_TRUE(is_closed(voxel_surface(block_of(5, [](const Vec3&) { return true; }))));
  EXPECT_TRUE(is_closed(voxel_surface(block_of(6, [](const Vec3& p) {
    return (static_cast<int>(p.x()) + static_cast<int>(p.y()) + static_cast<int>(p.z())) % 2 == 0;
  }))));
  EXPECT_TRUE(is_closed(voxel_surface(block_of(2, [](const Vec3& p) { return p.x() == p.y() && p.y() == p.z(); }))));
}

TEST(VoxelSurface, StaysWithinAVoxelOfTheVoxels) {
  const client::Surface cube =
      voxel_surface(block_of(12, [](const Vec3& p) { return p.minCoeff() >= 3 && p.maxCoeff() <= 8; }));
  for (const auto& point : cube.points_mm) {
    const Vec3 place = (Vec3(point.data()) - Vec3(10, 20, 30)).cwiseQuotient(Vec3(0.5, 1, 2));
    EXPECT_GE(place.minCoeff(), 2.5 - 1e-9);
    EXPECT_LE(place.maxCoeff(), 9.5 + 1e-9);
  }
  EXPECT_GT(volume(cube), 0.75 * 216) << "edges are rounded";
}

TEST(VoxelSurface, OfNothingHasNoTriangles) {
  EXPECT_TRUE(voxel_surface(block_of(4, [](const Vec3&) { return false; })).triangles.empty());
}

}  // namespace
}  // namespace ccslice::cli
