// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_raster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "core/interpolation/pieces/block_shape.h"

namespace ccslice {
namespace {

using Map = std::function<Vec3(const Vec3&)>;  // Of parameters in [0, 1]^3.
using Voxel = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;

/// The image of a box of parameters.
BlockPoints block_of(const Map& map, const Vec3& low = Vec3::Zero(), const Vec3& high = Vec3::Ones()) {
  BlockPoints points;
  for (std::size_t n = 0; n < points.size(); ++n) {
    Vec3 uvw;
    for (int a = 0; a < 3; ++a) {
      const auto place = static_cast<double>(n / kBlockStride[static_cast<std::size_t>(a)] % kBlockNodes);
      uvw[a] = low[a] + place / (kBlockNodes - 1) * (high[a] - low[a]);
    }
    points[n] = map(uvw);
  }
  return points;
}

constexpr ScanBounds kBounds{60, 50, 3, 30};

void count(const BlockPoints& points, BlockRaster& raster, std::map<Voxel, int>& counts) {
  std::vector<BlockRun> runs;
  raster.scan(points, shape_of(points).step, kBounds, runs);
  for (const BlockRun& run : runs) {
    EXPECT_LT(run.begin, run.end);
    for (std::uint32_t x = run.begin; x < run.end; ++x) ++counts[{x, run.row, run.layer}];
  }
}

TEST(BlockRaster, TellsHowFarTheFacesAre) {
  BlockRaster raster;
  std::vector<BlockRun> runs;
  const BlockPoints box = block_of([](const Vec3& p) { return Vec3(2.25 + 20 * p.x(), 4 + 7.5 * p.y(), 40 * p.z()); });
  raster.scan(box, shape_of(box).step, kBounds, runs);
  ASSERT_FALSE(runs.empty());
  for (const BlockRun& run : runs) {
    EXPECT_EQ(run.begin, 3u);
    EXPECT_EQ(run.end, 23u);
    EXPECT_NEAR(run.before, 0.75, 1e-6);
    EXPECT_NEAR(run.after, 0.25, 1e-6);
  }
}

TEST(BlockRaster, FindsTheCentresInABox) {
  BlockRaster raster;
  std::map<Voxel, int> counts;
  count(block_of([](const Vec3& p) { return Vec3(-3.5 + 20 * p.x(), 4 + 7.5 * p.y(), 1.2 + 40 * p.z()); }), raster,
        counts);
  EXPECT_EQ(counts.size(), 17u * 8u * 27u);
  for (const auto& [voxel, times] : counts) {
    const auto [x, y, layer] = voxel;
    EXPECT_EQ(times, 1);
    EXPECT_TRUE(x < 17 && y >= 4 && y < 12 && layer >= 3 && layer < 30);
  }
}

/// A bent and twisted box, whose faces bulge.
Vec3 bent(const Vec3& p) {
  const double angle = 1.3 * p.x() + 0.4 * p.z(), radius = 12 + 20 * p.y();
  return {30 + radius * std::cos(angle), 2 + radius * std::sin(angle) + 2 * p.z(), 5 + 18 * p.z() + 3 * p.x() * p.y()};
}

Vec3 parameter_of(const Vec3& voxel) {
  Vec3 p = Vec3::Constant(0.5);
  for (int n = 0; n < 50; ++n) {
    Mat3 jacobian;
    for (int a = 0; a < 3; ++a)
      jacobian.col(a) = (bent(p + 1e-6 * Vec3::Unit(a)) - bent(p - 1e-6 * Vec3::Unit(a))) / 2e-6;
    p += jacobian.inverse() * (voxel - bent(p));
  }
  return p;
}

/// How far a parameter lies outside of the unit cube, or inside it if negative.
double outside(const Vec3& p) { return ((p.array() - 0.5).abs() - 0.5).maxCoeff(); }

TEST(BlockRaster, FollowsCurvedFaces) {
  BlockRaster raster;
  std::map<Voxel, int> counts;
  count(block_of(bent), raster, counts);
  constexpr double kBulge = 0.05;  // In parameters.
  std::size_t inside = 0;
  for (std::uint32_t layer = kBounds.first_layer; layer < kBounds.end_layer; ++layer) {
    for (std::uint32_t y = 0; y < kBounds.rows; ++y) {
      for (std::uint32_t x = 0; x < kBounds.columns; ++x) {
        const double off = outside(parameter_of(Vec3(x, y, layer)));
        const int times = counts.contains({x, y, layer}) ? counts[{x, y, layer}] : 0;
        if (std::abs(off) > kBulge) {
          EXPECT_EQ(times, off < 0 ? 1 : 0) << x << " " << y << " " << layer;
        }
        inside += off < 0;
      }
    }
  }
  EXPECT_GT(inside, 5000u);
}

// Eight blocks that share faces, nodes and all.
TEST(BlockRaster, PartsTileTheirWhole) {
  BlockRaster raster;
  std::map<Voxel, int> whole, parts;
  count(block_of(bent), raster, whole);
  for (int child = 0; child < 8; ++child) {
    const Vec3 low(child & 1 ? 0.5 : 0, child & 2 ? 0.5 : 0, child & 4 ? 0.5 : 0);
    count(block_of(bent, low, low + Vec3::Constant(0.5)), raster, parts);
  }
  std::size_t twice = 0, lost = 0;
  for (const auto& [voxel, times] : parts) twice += times > 1;
  for (const auto& [voxel, times] : whole) lost += !parts.contains(voxel);
  EXPECT_EQ(twice, 0u);
  EXPECT_LT(static_cast<double>(lost), 0.02 * static_cast<double>(whole.size()));
}

TEST(BlockRaster, LeavesOutWhatTheWindowDoesNotHold) {
  BlockRaster raster;
  std::map<Voxel, int> counts;
  count(block_of([](const Vec3& p) { return Vec3(100 + 20 * p.x(), 10 * p.y(), 10 * p.z()); }), raster, counts);
  count(block_of([](const Vec3& p) { return Vec3(20 * p.x(), 10 * p.y(), 31 + 10 * p.z()); }), raster, counts);
  count(block_of([](const Vec3& p) { return Vec3(20 * p.x(), -11 + 10 * p.y(), 10 * p.z()); }), raster, counts);
  EXPECT_TRUE(counts.empty());
}

TEST(BlockRaster, BearsFlatAndFoldedBlocks) {
  BlockRaster raster;
  std::map<Voxel, int> counts;
  count(block_of([](const Vec3& p) { return Vec3(20 * p.x(), 10 * p.y(), 7); }), raster, counts);
  EXPECT_TRUE(counts.empty());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-5, 65);
  for (int n = 0; n < 20; ++n) {
    BlockPoints points;
    for (Vec3& p : points) p = Vec3(place(random), place(random), place(random));
    count(points, raster, counts);
  }
  for (const auto& [voxel, times] : counts) EXPECT_LT(std::get<0>(voxel), kBounds.columns);
}

TEST(BlockShape, MeasuresABox) {
  const BlockShape shape = shape_of(block_of([](const Vec3& p) { return Vec3(20 * p.x(), 5 * p.y(), 8 * p.z()); }));
  EXPECT_NEAR(shape.voxels, 800, 1e-9);
  EXPECT_NEAR(shape.thickness_along_x(), 20, 1e-9);
  EXPECT_EQ(shape.bent_axes(), 0u);
  EXPECT_FALSE(shape.flat);
}

TEST(BlockShape, TellsAlongWhichAxisAShellIsBent) {
  const auto shell = [](const Vec3& p) {
    const double angle = 0.8 * p.y(), radius = 40 + p.x();
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), 30 * p.z());
  };
  const BlockShape whole = shape_of(block_of(shell));
  EXPECT_EQ(whole.bent_axes(), 2u);
  EXPECT_NEAR(whole.bulge.y(), 41 * (1 - std::cos(0.1)), 0.01);
  EXPECT_NEAR(whole.bulge.x(), 0, 1e-9);
  EXPECT_NEAR(whole.bulge.z(), 0, 1e-9);
  EXPECT_EQ(shape_of(block_of(shell, Vec3::Zero(), Vec3(1, 0.125, 1))).bent_axes(), 0u);
}

// A bend of a tenth of a voxel needs no fine triangles, unless the block is hardly thicker.
TEST(BlockShape, ChoosesTrianglesByVoxelsAndByThickness) {
  const auto plate = [](double thickness, double bend) {
    return shape_of(block_of([=](const Vec3& p) {
      return Vec3(20 * p.x(), 20 * p.y(), thickness * p.z() + 4 * bend * p.x() * (1 - p.x()));
    }));
  };
  EXPECT_EQ(plate(15, 0).step, 4u);
  EXPECT_EQ(plate(15, 0.1).step, 4u);
  EXPECT_NEAR(plate(15, 0.1).bulge.x(), 0.1 / 15, 1e-9);
  EXPECT_EQ(plate(15, 0.5).step, 2u);
  EXPECT_EQ(plate(2, 0.1).step, 1u);
  EXPECT_NEAR(plate(2, 0.1).bulge.x(), 0.1 / 2 / 16, 1e-9);
}

TEST(BlockShape, KnowsWhatIsFlat) {
  EXPECT_TRUE(shape_of(block_of([](const Vec3& p) { return Vec3(p.x(), p.y(), 0); })).flat);
}

}  // namespace
}  // namespace ccslice
