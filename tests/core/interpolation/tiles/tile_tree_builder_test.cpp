// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_tree_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "tests/core/interpolation/tiles_and_inversions.h"

namespace ccslice {
namespace {

TEST_F(TilesTest, InterpolateNearlyAllOfASmoothChannelAndInvertNothing) {
  take(box(0), smooth);
  Tiles tiles(solid_, grid_, {});
  const Result result = run(tiles);
  EXPECT_GT(result.stats.voxels_inside, 80'000u);
  EXPECT_LE(result.worst, kTolerance);
  EXPECT_GT(result.interpolated(), 0.99);
  EXPECT_EQ(tiles.field.inverted.size(), result.stats.voxels_inside - result.stats.voxels_interpolated);
}

TEST_F(TilesTest, KeepTheToleranceInJitteredCells) {
  take(box(), smooth);
  const Result result = run();
  EXPECT_LE(result.worst, kTolerance);
  EXPECT_GT(result.interpolated(), 0.5);
}

// Cells are bent, but the channel follows the place in them.
TEST_F(TilesTest, ALinearChannelIsExact) {
  ControlMesh mesh = box();
  for (Vec3& p : mesh.positions) p = p.cast<float>().cast<double>();
  take(mesh, [](const Vec3& p) { return p.x() / 16; });
  const Result result = run();
  EXPECT_LE(result.worst, 2e-7) << "a float's rounding, and what inversion accepts";
  EXPECT_EQ(result.stats.voxels_interpolated, result.stats.voxels_inside);
}

TEST_F(TilesTest, AConstantChannelIsConstant) {
  take(box(), [](const Vec3&) { return 0.3; });
  plane_ = ContonePlane(float_plane(), solid_->summary().channels[0], 0);
  const Result result = run({.tolerance = 1e-9});
  EXPECT_EQ(result.stats.voxels_interpolated, result.stats.voxels_inside);
  const double expected = 0.3f;
  for (const VoxelRun& span : exact_slab(16).back().spans) EXPECT_EQ(sample(span.begin, span.row), expected);
}

// In the limit three tenths of the difference are left, and that beside one point only.
TEST_F(TilesTest, SeeASingleControlPointThatDiffers) {
  const ControlMesh mesh = box();
  const Vec3 middle = kCellMm * Vec3(6, 5, 3);
  const Vec3 odd = *std::ranges::min_element(mesh.positions, {}, [&](const Vec3& p) { return (p - middle).norm(); });
  for (const double tolerances : {3.0, 4.0, 6.0, 30.0, 1000.0}) {
    take(mesh, [&](const Vec3& p) { return p == odd ? 0.5 + tolerances * kTolerance : 0.5; });
    const Result result = run();
    EXPECT_LE(result.worst, kTolerance) << tolerances;
    EXPECT_GT(result.interpolated(), 0.7) << tolerances;
  }
}

// B-splines of a cubic's values in equal cells are cubic, but for the cells at the boundary.
TEST_F(TilesTest, KeepAStrictTolerance) {
  take(box(0), [](const Vec3& p) { return 0.3 + p.x() * (p.x() - 4) * (p.y() - 8) / 400; });
  const Result result = run({.tolerance = 1e-7});
  EXPECT_LE(result.worst, 1e-7 + kRounding);
  EXPECT_GT(result.interpolated(), 0.3);
  take(box(), smooth);
  EXPECT_LE(run({.tolerance = 1e-7}).worst, 1e-7 + kRounding);
}

TEST_F(TilesTest, InvertWhatNoPolynomialFits) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  take(box(), [&](const Vec3&) { return share(random); });
  const Result result = run();
  EXPECT_LE(result.worst, kTolerance);
  EXPECT_LT(result.interpolated(), 0.1);
}

// Voxels that lie off the solid take what its boundary has: a polynomial that goes on beyond it is off there.
TEST_F(TilesTest, InvertSteepMaterialsBesideTheBoundary) {
  take(box(0), [](const Vec3& p) { return p.x() / 16; });
  const Result flat = run({.outside_mm = 0.01}), steep = run({.outside_mm = 0.02});
  EXPECT_EQ(flat.stats.voxels_interpolated, flat.stats.voxels_inside);
  EXPECT_LE(steep.worst, kTolerance);
  EXPECT_LT(steep.interpolated(), 0.95);
  EXPECT_GT(steep.interpolated(), 0.3) << "inside all is as it was";
  Tiles tiles(solid_, grid_, {.outside_mm = 0.02});
  run(tiles);
  const double left = grid_.part_box.min().x() + 0.05, right = grid_.part_box.max().x() - 0.05;
  EXPECT_GT(expect_inverted(tiles, 16, [&](const Vec3& p) { return p.x() < left || p.x() > right; }), 500u);
}

TEST_F(TilesTest, InvertWhereTheSolidFolds) {
  ControlMesh mesh = oracle::refined_mesh(oracle::refined_mesh(oracle::folding_box_mesh()));
  for (Vec3& p : mesh.positions) p *= 0.2;
  mesh.allow_folds = true;
  take(mesh, smooth);
  ASSERT_GT(solid_->summary().folding_cells, 0u);
  Tiles tiles(solid_, grid_, {});
  const Result result = run(tiles, 32);
  EXPECT_GT(result.interpolated(), 0.1);
  const auto is_ambiguous = [&](const Vec3& p) { return tiles.field.is_ambiguous(Box3(p, p)); };
  EXPECT_GT(expect_inverted(tiles, 32, is_ambiguous), 1000u);
}

// No centre lies in the gap.
TEST_F(TilesTest, PartsSideBySideKeepTheirOwnMaterials) {
  ControlMesh mesh = oracle::box_mesh(6, 6, 6, kCellMm);
  oracle::append_mesh(mesh, ControlMesh(mesh), Vec3(6 * kCellMm + 0.03, 0, 0));
  for (const bool constant : {true, false}) {
    take(mesh, [&](const Vec3& p) { return p.x() < 6 * kCellMm + 0.01 ? 0.25 : constant ? 0.75 : 0.75 + p.y() / 100; });
    ASSERT_EQ(solid_->data().parts.size(), 0u) << "they don't overlap";
    const Result result = run();
    EXPECT_LE(result.worst, kTolerance);
    EXPECT_GT(result.interpolated(), 0.7);
  }
}

TEST_F(TilesTest, NeedNothingBeyondTheContours) {
  const auto in_ball = [](const Vec3& p) { return (p - Vec3(4.5, 4, 2)).norm() < 2.2; };
  inside_ = in_ball;
  take(box(), smooth);
  for (const double tolerance : {kTolerance, 1e-5}) {
    Tiles tiles(solid_, grid_, {.tolerance = tolerance});
    const Result result = run(tiles);
    EXPECT_LE(result.worst, tolerance);
    for (const Vec3& p : tiles.field.inverted) EXPECT_TRUE(in_ball(p)) << p.transpose();
  }
}

TEST_F(TilesTest, CountVoxelsThatInversionDoesNotReach) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  take(box(), [&](const Vec3&) { return share(random); });
  Tiles tiles(solid_, grid_, {.tolerance = 1e-7});
  const Box3 hole(Vec3(3, 3, 0), Vec3(4, 4, 9));
  tiles.field.unreachable = [&](const Vec3& p) { return hole.contains(p); };
  const Result result = run(tiles);
  EXPECT_EQ(result.stats.voxels_unresolved,
            static_cast<std::uint64_t>(std::ranges::count_if(tiles.field.inverted, tiles.field.unreachable)));
  EXPECT_GT(result.stats.voxels_unresolved, 800u);
  EXPECT_EQ(tiles.field.nearest_calls, 0u) << "solved voxels of the layer do";
}

TEST_F(TilesTest, ALayerThatNothingReachesTakesTheNearestOfTheSolid) {
  inside_ = [](const Vec3& p) { return (p - Vec3(4.5, 4, 2)).norm() < 0.5; };
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  take(box(), [&](const Vec3&) { return share(random); });
  Tiles tiles(solid_, grid_, {.tolerance = 1e-7});
  tiles.field.unreachable = [](const Vec3&) { return true; };
  const Result result = run(tiles);
  EXPECT_GT(result.stats.voxels_inside, 0u);
  EXPECT_EQ(result.stats.voxels_unresolved, result.stats.voxels_inside);
  EXPECT_EQ(tiles.field.nearest_calls, result.stats.voxels_inside);
  EXPECT_LE(result.worst, 1e-5) << "nearest() finds the place itself";
}

// Of many materials, so that some tiles are fitted, some halved, some inverted.
TEST_F(TilesTest, ASlabKnowsNothingOfOthers) {
  take(box(), [](const Vec3& p) { return smooth(p) + 0.01 * std::abs(p.x() - 2 * p.z()); });
  Tiles upwards(solid_, grid_, {}), downwards(solid_, grid_, {});
  std::vector<Result> up;
  for (const std::uint32_t slab : {0u, 16u, 32u, 48u}) up.push_back(run(upwards, slab));
  for (const std::uint32_t slab : {48u, 32u, 16u, 0u}) {
    const Result down = run(downwards, slab);
    const Result& expected = up[slab / kSlabLayers];
    EXPECT_TRUE(down.bytes == expected.bytes) << slab;
    EXPECT_EQ(down.stats.voxels_interpolated, expected.stats.voxels_interpolated);
    EXPECT_EQ(down.stats.voxels_full, expected.stats.voxels_full);
    EXPECT_LE(down.worst, kTolerance) << slab;
  }
  EXPECT_GT(up[1].interpolated(), 0.1);
  EXPECT_LT(up[1].interpolated(), 0.9);
  EXPECT_LT(grid_.extent.layers, 64u) << "the last slab is cut off by the grid";
}

TEST_F(TilesTest, StopSoonAfterACancel) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  take(box(), [&](const Vec3&) { return share(random); });
  Tiles tiles(solid_, grid_, {});
  const Result expected = run(tiles);
  for (const std::size_t when : {300u, 60'000u}) {
    const CancellationToken cancel = CancellationToken::make();
    tiles.field.inverted.clear();
    tiles.field.on_invert = [&] {
      if (tiles.field.inverted.size() == when) cancel.cancel();
    };
    EXPECT_THROW(run(tiles, 16, cancel), Error);
    EXPECT_GE(tiles.field.inverted.size(), when);
    EXPECT_LE(tiles.field.inverted.size(), when + 3000);
  }
  tiles.field.on_invert = {};
  for (const int when : {1, 2, 9, 40}) {
    const CancellationToken cancel = CancellationToken::make();
    int boxes = 0;
    tiles.field.on_question = [&] {
      if (++boxes == when) cancel.cancel();
    };
    EXPECT_THROW(run(tiles, 16, cancel), Error);
    EXPECT_LE(boxes, when + 1) << "that are fitted to";
    tiles.field.on_question = {};
    EXPECT_TRUE(run(tiles).bytes == expected.bytes) << "nothing is left of what was cancelled";
  }
}

TEST_F(TilesTest, AnEmptySlabTakesNothing) {
  take(box(), smooth);
  inside_ = [](const Vec3&) { return false; };
  Tiles tiles(solid_, grid_, {});
  const Result result = run(tiles);
  EXPECT_TRUE(tiles.field.inverted.empty());
  EXPECT_EQ(result.stats.voxels_inside, 0u);
  EXPECT_EQ(result.stats.max_residual_mm, 0.0);
}

}  // namespace
}  // namespace ccslice
