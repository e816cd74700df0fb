// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/material_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/base/error.h"

namespace ccslice {
namespace {

using Function = std::function<double(const Vec3&)>;

// The identity as a solid whose only channel is any function of the world point.
class FunctionField final : public MaterialField {
 public:
  std::optional<InversionResult> invert(const Vec3& world, const std::optional<CellParam>& hint) override {
    ++inversions;
    if (on_invert) on_invert();
    if (unreachable && unreachable(world)) return std::nullopt;
    return InversionResult{{0, world}, 1e-9, 2, !hint};
  }
  std::optional<InversionResult> nearest(const Vec3& world) override {
    ++nearest_calls;
    return InversionResult{{0, world}, 100, 9, true};
  }
  void mat(const CellParam& at, std::span<double> out) override { out[0] = function(at.uvw); }
  bool is_ambiguous(const Box3& world) const override { return ambiguous.intersects(world); }
  void append_irregular_points(const Box3&, double, std::vector<Vec3>& points) override {
    points.insert(points.end(), irregular_points.begin(), irregular_points.end());
  }
  bool any_middle(const Box3& world, const AcceptMiddle& accept) const override {
    return std::any_of(middles.begin(), middles.end(), [&](const Vec3& middle) {
      const double channel = function(middle);
      return world.contains(middle) && accept(middle, std::span(&channel, 1));
    });
  }
  std::size_t channel_count() const override { return 1; }

  Function function = [](const Vec3&) { return 0.5; };
  std::function<bool(const Vec3&)> unreachable;
  std::function<void()> on_invert;
  Box3 ambiguous;
  std::vector<Vec3> irregular_points, middles;
  std::size_t inversions = 0;
  int nearest_calls = 0;
};

constexpr double kTolerance = 1.0 / 1024;

class MaterialTilesTest : public testing::Test {
 protected:
  MaterialTilesTest() : plane_(float_plane(), {"", -10, 10}) {
    grid_.origin_mm = Vec3(-3, 2, 1);
    grid_.pitch = {0.1, 0.12, 0.09};
    grid_.extent = {90, 70, 40};
    inside_ = [](std::uint32_t, std::uint32_t, std::uint32_t) { return true; };
  }

  static PlaneSpec float_plane() {
    PlaneSpec spec;
    spec.content = PlaneContent::kChannel;
    spec.sample_type = SampleType::kFloat32;
    return spec;
  }

  Vec3 centre(std::uint32_t x, std::uint32_t y, std::uint32_t layer) const {
    return grid_.origin_mm +
           Vec3((x + 0.5) * grid_.pitch.x_mm, (y + 0.5) * grid_.pitch.y_mm, (layer + 0.5) * grid_.pitch.z_mm);
  }

  std::vector<Span> spans_of(std::uint32_t layer) const {
    std::vector<Span> spans;
    for (std::uint32_t y = 0; y < grid_.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < grid_.extent.columns; ++x) {
        if (!inside_(x, y, layer)) continue;
        if (!spans.empty() && spans.back().y == y && spans.back().end == x) {
          ++spans.back().end;
        } else {
          spans.push_back({y, x, x + 1});
        }
      }
    }
    return spans;
  }

  struct Result {
    LayerStats stats;
    double worst = 0;          // Over all voxels inside.
    std::uint64_t beyond = 0;  // Voxels that miss the tolerance.
    std::size_t inversions = 0;
    std::vector<std::uint8_t> bytes;
  };

  /// Solves and paints one slab.
  Result run(MaterialTiles& tiles, std::uint32_t first_layer, const CancellationToken& cancel = {}) {
    std::vector<std::vector<Span>> layers;
    for (std::uint32_t k = first_layer; k < std::min(first_layer + kSlabLayers, grid_.extent.layers); ++k) {
      layers.push_back(spans_of(k));
    }
    const std::size_t before = field_.inversions;
    tiles.solve(first_layer, std::vector<std::span<const Span>>(layers.begin(), layers.end()), cancel);
    Result result;
    for (std::uint32_t l = 0; l < layers.size(); ++l) {
      plane_.clear(grid_.extent.columns, grid_.extent.rows);
      const LayerWindow all = window_of(grid_.lattice());
      const LayerTarget target{
          grid_.lattice(), grid_.layer_z_mm(first_layer + l), std::span(&plane_, 1), result.stats, cancel, all, all};
      tiles.paint(target, first_layer + l, layers[l], {}, layers[l]);
      add(layers[l], first_layer + l, result);
    }
    result.inversions = field_.inversions - before;
    return result;
  }

  Result run(std::uint32_t first_layer = 0, const CancellationToken& cancel = {}) {
    MaterialTiles tiles = make_tiles();
    return run(tiles, first_layer, cancel);
  }

  /// Voxels lie off the solid by so little that it never matters.
  MaterialTiles make_tiles(double tolerance = kTolerance, double outside_mm = 1e-9) {
    return {field_, {Placement::Identity(), grid_, {{0, tolerance}}, outside_mm}};
  }

  void add(const std::vector<Span>& spans, std::uint32_t layer, Result& result) const {
    const std::span<const std::uint8_t> samples = plane_.image().samples;
    result.bytes.insert(result.bytes.end(), samples.begin(), samples.end());
    for (const Span& span : spans) {
      result.stats.voxels_inside += span.end - span.begin;
      for (std::uint32_t x = span.begin; x < span.end; ++x) {
        const double error = std::abs(sample(x, span.y) - field_.function(centre(x, span.y, layer)));
        result.worst = std::max(result.worst, error);
        result.beyond += error > kTolerance;
      }
    }
  }

  double sample(std::uint32_t x, std::uint32_t y) const {
    float value;
    std::memcpy(&value, &plane_.image().samples[4 * (std::size_t{grid_.extent.columns} * y + x)], sizeof value);
    return value;
  }

  static void expect_all_counted(const Result& result) {
    const LayerStats& stats = result.stats;
    EXPECT_EQ(stats.voxels_interpolated + stats.voxels_coherent + stats.voxels_full + stats.voxels_unresolved,
              stats.voxels_inside);
  }

  FunctionField field_;
  Grid grid_;
  ContonePlane plane_;
  std::function<bool(std::uint32_t, std::uint32_t, std::uint32_t)> inside_;
};

double smooth(const Vec3& p) {
  return std::sin(0.2 * p.x() + 0.1) * std::cos(0.15 * p.y()) + 0.2 * std::exp(0.2 * p.z());
}

// A bump of a few voxels that no sample meets.
TEST_F(MaterialTilesTest, LookAtTheMiddlesOfCells) {
  const Vec3 bump = centre(52, 29, 9);
  const double width = 2.5 * (centre(1, 0, 0) - centre(0, 0, 0)).x();
  field_.function = [=](const Vec3& p) {
    return 0.1 * p.x() + 0.1 * std::exp(-0.5 * (p - bump).squaredNorm() / (width * width));
  };
  const Result unseen = run();
  EXPECT_GT(unseen.worst, 0.05);
  for (int n = 0; n < 216; ++n) {  // None is where the bump is highest.
    field_.middles.push_back(bump + width * Vec3(2 * (n % 6) - 5, 2 * (n / 6 % 6) - 5, 2 * (n / 36) - 5));
  }
  const Result seen = run();
  EXPECT_LE(seen.worst, kTolerance);
  EXPECT_GT(seen.stats.voxels_interpolated, seen.stats.voxels_inside / 2);
}

// A cubic through three layers says nothing about what is between them, where cells' middles lie.
TEST_F(MaterialTilesTest, DontLookAtMiddlesBetweenFewLayers) {
  field_.function = [](const Vec3& p) { return 0.1 * p.x() + 0.2 * p.z() + 1; };
  for (const std::uint32_t layers : {1u, 2u, 3u}) {
    grid_.extent.layers = layers;
    field_.middles = {centre(30, 30, 0) + Vec3(0, 0, 0.3 * grid_.pitch.z_mm)};
    const Result result = run();
    EXPECT_LE(result.worst, kTolerance);
    EXPECT_EQ(result.stats.voxels_interpolated, result.stats.voxels_inside) << layers;
  }
}

TEST_F(MaterialTilesTest, AFewInversionsDoForASmoothFunction) {
  field_.function = smooth;
  const Result result = run();
  expect_all_counted(result);
  EXPECT_LE(result.worst, kTolerance);
  EXPECT_EQ(result.stats.voxels_inside, 90u * 70 * 16);
  EXPECT_GT(result.stats.voxels_interpolated, result.stats.voxels_inside * 99 / 100);
  EXPECT_LT(result.inversions, result.stats.voxels_inside / 40);
  EXPECT_EQ(result.stats.max_residual_mm, 1e-9);
}

TEST_F(MaterialTilesTest, NeedsNothingBeyondTheContours) {
  field_.function = smooth;
  const auto in_ball = [](const Vec3& p) { return (p - Vec3(1.5, 6.2, 1.7)).norm() < 2.7; };
  inside_ = [=, this](std::uint32_t x, std::uint32_t y, std::uint32_t layer) { return in_ball(centre(x, y, layer)); };
  field_.unreachable = [=](const Vec3& p) { return !in_ball(p); };
  const Result result = run();
  expect_all_counted(result);
  EXPECT_LE(result.worst, kTolerance);
  EXPECT_EQ(result.stats.voxels_unresolved, 0u);
  EXPECT_GT(result.stats.voxels_interpolated, result.stats.voxels_inside * 9 / 10);
}

// The curvature jumps there, as it may between limit cells at their worst; values and slopes don't.
TEST_F(MaterialTilesTest, KeepsTheToleranceAtACrease) {
  for (const double place : {0.0, 0.37, 1.52, 2.2}) {
    field_.function = [=](const Vec3& p) {
      const double depth = p.x() + 0.3 * p.y() - 0.1 * p.z() - 2 - place;
      return 0.2 * depth * std::abs(depth);
    };
    const Result result = run();
    expect_all_counted(result);
    EXPECT_LE(result.worst, kTolerance) << place;
    EXPECT_GT(result.stats.voxels_interpolated, result.stats.voxels_inside / 2) << place;
  }
}

// What no solid has inside: values may miss the tolerance in voxels between samples, but hardly any do.
TEST_F(MaterialTilesTest, LooksClosestAtAKink) {
  for (const double place : {0.0, 0.37, 1.52, 2.2}) {
    field_.function = [=](const Vec3& p) { return std::abs(p.x() + 0.3 * p.y() - 0.1 * p.z() - 2 - place); };
    const Result result = run();
    expect_all_counted(result);
    EXPECT_LE(result.beyond, result.stats.voxels_inside / 10'000) << place;
    EXPECT_LT(result.stats.voxels_interpolated, result.stats.voxels_inside) << place;
  }
}

// As at an extraordinary edge: smooth everywhere but at a line, whose points the solid tells.
TEST_F(MaterialTilesTest, KeepsTheToleranceAtIrregularLines) {
  const auto distance = [](const Vec3& p) { return std::hypot(p.x() - 0.731, p.y() - 5.52); };
  for (double z = 1; z < 2.5; z += 0.09) field_.irregular_points.emplace_back(0.731, 5.52, z);
  for (const double power : {-0.5, 0.5, 1.0}) {
    field_.function = [=](const Vec3& p) { return std::pow(distance(p) + (power < 0 ? 0.05 : 0), power); };
    const Result result = run();
    expect_all_counted(result);
    EXPECT_LE(result.worst, kTolerance) << power;
    EXPECT_GT(result.stats.voxels_interpolated, 0u) << power;
  }
}

TEST_F(MaterialTilesTest, PartsSideBySideKeepTheirOwnMaterials) {
  const double gap_mm = centre(37, 0, 0).x();
  inside_ = [](std::uint32_t x, std::uint32_t, std::uint32_t) { return x != 37; };
  field_.function = [=](const Vec3& p) { return p.x() < gap_mm ? 0.25 : 0.75 + 0.01 * p.y(); };
  Result result = run();
  expect_all_counted(result);
  EXPECT_LE(result.worst, kTolerance);
  // A part that is a single row of voxels within its tile.
  inside_ = [](std::uint32_t x, std::uint32_t y, std::uint32_t layer) {
    return x < 36 || (x > 37 && y == 20 && layer == 7);
  };
  result = run();
  expect_all_counted(result);
  EXPECT_LE(result.worst, kTolerance);
}

TEST_F(MaterialTilesTest, CountsVoxelsThatInversionDoesNotReach) {
  field_.function = smooth;
  const Box3 hole(Vec3(-1, 3, 0), Vec3(2, 6, 9));
  field_.ambiguous = hole;
  field_.unreachable = [=](const Vec3& p) { return hole.contains(p); };
  const Result result = run();
  expect_all_counted(result);
  std::uint64_t unreachable = 0;
  for (std::uint32_t x = 0; x < grid_.extent.columns; ++x) {
    for (std::uint32_t y = 0; y < grid_.extent.rows; ++y) unreachable += hole.contains(centre(x, y, 3)) ? 16 : 0;
  }
  EXPECT_EQ(result.stats.voxels_unresolved, unreachable);
  EXPECT_EQ(field_.nearest_calls, 0) << "solved voxels of the layer do";
}

TEST_F(MaterialTilesTest, ALayerThatNothingReachesTakesTheNearestOfTheSolid) {
  grid_.extent = {20, 20, 16};
  field_.unreachable = [](const Vec3&) { return true; };
  const Result result = run();
  EXPECT_EQ(result.stats.voxels_unresolved, result.stats.voxels_inside);
  EXPECT_EQ(field_.nearest_calls, static_cast<int>(result.stats.voxels_inside));
  EXPECT_EQ(result.worst, 0) << "nearest() tells the place itself";
}

TEST_F(MaterialTilesTest, InvertsEveryVoxelWhereTheSolidIsAmbiguous) {
  field_.function = smooth;
  field_.ambiguous = Box3(Vec3::Constant(-100), Vec3::Constant(100));
  Result result = run();
  EXPECT_EQ(result.stats.voxels_coherent + result.stats.voxels_full, result.stats.voxels_inside);
  EXPECT_LT(result.worst, 1e-6);
  field_.ambiguous = Box3(Vec3(-0.5, 4, 1.5), Vec3(0.5, 5, 1.8));
  result = run();
  expect_all_counted(result);
  EXPECT_GE(result.stats.voxels_coherent + result.stats.voxels_full, 10u * 8 * 3);
  EXPECT_GT(result.stats.voxels_interpolated, result.stats.voxels_inside / 2);
}

TEST_F(MaterialTilesTest, AConstantChannelIsConstant) {
  field_.function = [](const Vec3&) { return 0.5; };
  plane_ = ContonePlane(float_plane(), {"", 0.5, 0.5});
  MaterialTiles tiles = make_tiles(1e-9);
  const Result result = run(tiles, 0);
  EXPECT_EQ(result.worst, 0);
  EXPECT_EQ(result.stats.voxels_interpolated, result.stats.voxels_inside);
}

// Where the gradient takes more than half of the tolerance over what voxels may lie off the solid.
TEST_F(MaterialTilesTest, InvertsEndsOfRowsWhereMaterialsAreSteep) {
  field_.function = [](const Vec3& p) { return 0.3 * p.x(); };
  MaterialTiles flat = make_tiles(1e-3, 1.6e-3), steep = make_tiles(1e-3, 1.7e-3);
  const Result of_flat = run(flat, 0), of_steep = run(steep, 0);
  EXPECT_EQ(of_flat.stats.voxels_interpolated, of_flat.stats.voxels_inside);
  expect_all_counted(of_steep);
  EXPECT_EQ(of_steep.stats.voxels_inside - of_steep.stats.voxels_interpolated, 2u * 70 * kSlabLayers);
}

TEST_F(MaterialTilesTest, ASlabKnowsNothingOfOthers) {
  field_.function = [](const Vec3& p) { return smooth(p) + std::abs(p.x() - p.z()); };
  MaterialTiles upwards = make_tiles(), downwards = make_tiles();
  std::vector<Result> up;
  for (const std::uint32_t slab : {0u, 16u, 32u}) up.push_back(run(upwards, slab));
  for (const std::uint32_t slab : {32u, 16u, 0u}) {
    const Result down = run(downwards, slab);
    const Result& expected = up[slab / kSlabLayers];
    EXPECT_TRUE(down.bytes == expected.bytes) << slab;
    EXPECT_EQ(down.stats.voxels_interpolated, expected.stats.voxels_interpolated);
    EXPECT_EQ(down.stats.voxels_full, expected.stats.voxels_full);
    EXPECT_EQ(down.inversions, expected.inversions);
  }
  EXPECT_EQ(up[2].stats.voxels_inside, 90u * 70 * 8) << "the last slab is cut off by the grid";
  EXPECT_LE(up[2].worst, kTolerance);
}

TEST_F(MaterialTilesTest, KeepsAStrictToleranceToo) {
  field_.function = smooth;
  MaterialTiles strict = make_tiles(1e-7);
  const Result result = run(strict, 0);
  expect_all_counted(result);
  EXPECT_LE(result.worst, 1e-7 + 1e-6 / 8) << "and a float's rounding";
}

TEST_F(MaterialTilesTest, StopsSoonAfterACancel) {
  field_.function = [](const Vec3& p) { return std::sin(1e4 * p.x()); };  // No polynomial does: all are inverted.
  for (const std::size_t when : {300u, 60'000u}) {
    const CancellationToken cancel = CancellationToken::make();
    field_.inversions = 0;
    field_.on_invert = [&] {
      if (field_.inversions == when) cancel.cancel();
    };
    EXPECT_THROW(run(0, cancel), Error);
    EXPECT_GE(field_.inversions, when);
    EXPECT_LE(field_.inversions, when + 3000);
  }
}

TEST_F(MaterialTilesTest, AnEmptySlabTakesNothing) {
  inside_ = [](std::uint32_t, std::uint32_t, std::uint32_t) { return false; };
  const Result result = run();
  EXPECT_EQ(result.inversions, 0u);
  EXPECT_EQ(result.stats.voxels_inside, 0u);
  EXPECT_EQ(result.stats.max_residual_mm, 0.0);
}

}  // namespace
}  // namespace ccslice
