// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_fitter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/limit/cell_bricks.h"
#include "core/limit/cell_index.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr double kTileTolerance = 1.0 / 1024;
constexpr double kTileOutside = 1e-5;  // mm. So little that it never matters.
using Outcome = TileFitter::Outcome;
using Function = std::function<double(const Vec3&)>;

double smooth(const Vec3& p) { return 0.5 + 0.2 * std::sin(0.2 * p.x() + 0.1) * std::cos(0.2 * p.y()) + 0.03 * p.z(); }

void grade_tiles(ControlMesh& mesh, const std::vector<Function>& channels) {
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  for (std::size_t c = 0; c < channels.size(); ++c) mesh.channel_names.push_back("channel " + std::to_string(c));
  for (const Vec3& p : mesh.positions) {
    for (const Function& channel : channels) mesh.channel_values.push_back(static_cast<float>(channel(p)));
  }
}

Function tile_noise(unsigned seed) {
  return [random = std::mt19937(seed)](const Vec3&) mutable {
    return std::uniform_real_distribution<double>(0, 1)(random);
  };
}

std::uint64_t voxels_in(const Box3& box) { return static_cast<std::uint64_t>((box.diagonal().array() + 1).prod()); }

/// Cubes of 0.75 mm, bent, at pitches of 0.1, 0.12 and 0.09 mm: 7.5 x 6.25 x 8.3 voxels each.
class TileFitterTest : public testing::Test {
 protected:
  static ControlMesh bent_box(double jitter_mm = 0.08) {
    ControlMesh mesh = oracle::box_mesh(12, 10, 6, 0.75);
    oracle::jitter(mesh, jitter_mm, 4);
    return mesh;
  }

  void take(ControlMesh mesh, const std::vector<Function>& channels, double outside_mm = kTileOutside,
            double tolerance = kTileTolerance, const VoxelPitch& pitch = {0.1, 0.12, 0.09}) {
    grade_tiles(mesh, channels);
    solid_ = prepare_solid(mesh);
    GridRequest request;
    request.pitch = pitch;
    spec_.grid = plan_grid(*solid_, spec_.placement, request);
    spec_.outside_mm = outside_mm;
    spec_.channels.clear();
    for (std::uint32_t c = 0; c < channels.size(); ++c) spec_.channels.push_back({c, tolerance});
    fitter_.emplace(solid_, spec_);
  }

  Outcome fit(const TileParticles::Range& particles, const Box3& box) {
    return fitter_->fit(particles, box, voxels_in(box));
  }

  /// The largest error, as a share of its tolerance, where a grid of parameters of all cells lies in the box.
  double error_in(const Box3& box) const {
    constexpr int kSteps = 7;
    const Placement voxel_of_world = voxel_of_mesh(spec_.placement, spec_.grid);
    LimitEvaluator evaluator(*solid_);
    std::vector<double> channels(solid_->channel_count());
    double worst = 0;
    for (const LimitCellId cell : solid_->cells()) {
      if (!solid_->index().cell_boxes.box(cell).transformed(voxel_of_world).intersects(box)) continue;
      for (int n = 0; n < (kSteps + 1) * (kSteps + 1) * (kSteps + 1); ++n) {
        const Vec3 steps(n % (kSteps + 1), n / (kSteps + 1) % (kSteps + 1), n / (kSteps + 1) / (kSteps + 1));
        const Vec3 voxel = voxel_of_world * evaluator.geo_and_mat({cell, steps / kSteps}, channels);
        if (!box.contains(voxel)) continue;
        for (std::size_t c = 0; c < channels.size(); ++c) {
          const double error = value_at(fitter_->polynomials()[c], fitter_->frame()(voxel)) - channels[c];
          worst = std::max(worst, std::abs(error) / spec_.channels[c].tolerance);
        }
      }
    }
    return worst;
  }

  std::size_t cells_meeting(const Box3& box) const {
    const Placement voxel_of_world = voxel_of_mesh(spec_.placement, spec_.grid);
    std::size_t count = 0;
    for (const LimitCellId cell : solid_->cells()) {
      count += solid_->index().cell_boxes.box(cell).transformed(voxel_of_world).intersects(box) ? 1 : 0;
    }
    return count;
  }

  /// Boxes of voxels that cover the solid.
  std::vector<Box3> boxes(const Vec3& size) const {
    const GridExtent& extent = spec_.grid.extent;
    std::vector<Box3> result;
    for (double z = 0; z < extent.layers; z += size.z()) {
      for (double y = 0; y < extent.rows; y += size.y()) {
        for (double x = 0; x < extent.columns; x += size.x()) {
          result.emplace_back(Vec3(x, y, z), Vec3(x, y, z) + size - Vec3::Ones());
        }
      }
    }
    return result;
  }

  Solid solid_;
  InterpolationSpec spec_;
  std::optional<TileFitter> fitter_;
};

TEST_F(TileFitterTest, FitsASmoothChannelOverManyCells) {
  take(bent_box(0), {smooth}, kTileOutside, 4e-3);
  const Box3 box(Vec3(16, 8, 16), Vec3(63, 47, 31));
  const TileParticles::Range found = fitter_->particles().enter(box, voxels_in(box), {});
  ASSERT_TRUE(found.known);
  EXPECT_GT(cells_meeting(box), 80u);
  ASSERT_EQ(fit(found, box), Outcome::kFits);
  EXPECT_LE(error_in(box), 1);
}

// Several cells of a brick are one particle where a polynomial leaves next to nothing out, and rough ones aren't.
TEST_F(TileFitterTest, TakesCellsOfABrickTogetherWhereTheyAreSmooth) {
  const Box3 box(Vec3(16, 8, 16), Vec3(63, 47, 31));
  const auto in_several = [](const TileParticle& particle) {
    return (particle.parameters.high - particle.parameters.low).maxCoeff() > 1;
  };
  take(bent_box(0), {smooth}, kTileOutside, 4e-3);
  ASSERT_GT(solid_->bricks().size(), 0u);
  TileParticles& smooth_ones = fitter_->particles();
  TileParticles::Range found = smooth_ones.enter(box, voxels_in(box), {});
  ASSERT_TRUE(found.known);
  EXPECT_LT(smooth_ones.members(found).size(), cells_meeting(box) / 2);
  EXPECT_TRUE(std::ranges::any_of(smooth_ones.members(found), [&](auto m) { return in_several(smooth_ones[m]); }));
  take(bent_box(0), {tile_noise(5)}, kTileOutside, 4e-3);
  TileParticles& rough_ones = fitter_->particles();
  found = rough_ones.enter(box, voxels_in(box), {});
  ASSERT_TRUE(found.known);
  EXPECT_TRUE(std::ranges::none_of(rough_ones.members(found), [&](auto m) { return in_several(rough_ones[m]); }));
}

// A wave whose crest lies in a brick, farther beyond its samples than the crest of a parabola may.
TEST_F(TileFitterTest, MeetsWhatABrickReachesBetweenItsSamples) {
  ControlMesh mesh = oracle::box_mesh(12, 4, 4, 1);
  for (Vec3& vertex : mesh.positions) {
    const double along = std::clamp(std::round(vertex.x()), 3.0, 9.0) - 6;
    vertex = Vec3(6 * vertex.x() - 36, 2 * (along * along * along - 7.75 * along) + 0.25 * vertex.y(), 4 * vertex.z());
  }
  oracle::sharpen_by_cells(mesh, 1);
  take(mesh, {[](const Vec3&) { return 1.0; }}, kTileOutside, kTileTolerance, {0.1, 0.1, 0.1});
  const Placement voxel_of_world = voxel_of_mesh(spec_.placement, spec_.grid);
  const Vec3 crest = voxel_of_world * Vec3(-9, 14.5, 8);
  const Box3 above(crest - Vec3(20, 3, 8), crest + Vec3(200, 20, 8));
  EXPECT_GT(cells_meeting(above), 0u);
  const TileParticles::Range found = fitter_->particles().enter(above, voxels_in(above), {});
  EXPECT_TRUE(!found.known || !fitter_->particles().members(found).empty());
}

// A ridge across each brick, turned to another axis: its tricubic polynomial misses it, but as the channel is constant,
// the brick stays whole.
TEST_F(TileFitterTest, MeetsAllThatResidualsLeaveOut) {
  ControlMesh mesh = oracle::box_mesh(12, 4, 4, 1);
  for (Vec3& vertex : mesh.positions) {
    vertex.y() = 0.05 * vertex.y() + (std::lround(vertex.x()) % 4 == 2 ? 1 : 0);
  }
  oracle::sharpen_by_cells(mesh, 1);
  spec_.placement.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  take(mesh, {[](const Vec3&) { return 1.0; }}, kTileOutside, kTileTolerance, {0.02, 0.03, 0.02});
  const GridExtent& extent = spec_.grid.extent;
  const Box3 all(Vec3::Zero(), Vec3(extent.columns, extent.rows, extent.layers));
  const TileParticles::Range found = fitter_->particles().enter(all, voxels_in(all), {});
  ASSERT_TRUE(found.known);
  const CellBricks& bricks = solid_->bricks();
  const Placement voxel_of_world = voxel_of_mesh(spec_.placement, spec_.grid);
  LimitEvaluator evaluator(*solid_);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  double farthest = 0;
  for (const std::uint32_t m : fitter_->particles().members(found)) {
    const TileParticle& particle = fitter_->particles()[m];
    ASSERT_NE(particle.brick, kNone);
    Box3 samples;
    for (std::size_t slot = 0; slot < kBlockSlots; ++slot) samples.extend(at_slot(particle.places, slot));
    samples = grown(samples, 0.06);
    for (int n = 0; n < 300; ++n) {
      const Vec3 at = Vec3(share(random), share(random), share(random)).cwiseProduct(particle.parameters.high);
      const Vec3 voxel = voxel_of_world * evaluator.geo(bricks.cell_param(bricks[particle.brick], at));
      EXPECT_TRUE(particle.bounds.contains(voxel));
      farthest = std::max(farthest, (samples.min() - voxel).maxCoeff());
    }
  }
  EXPECT_GT(farthest, 1) << "nothing is tested here";
}

// Boxes of all sizes, of many channels, inside and at the boundary, in each of which some outcome is right: whatever is
// said to fit has to.
TEST_F(TileFitterTest, WhatFitsKeepsTheToleranceEverywhere) {
  struct Case {
    std::string name;
    ControlMesh mesh;
    double mm;
  };
  std::vector<Case> cases{{"bent", bent_box(), 1}};
  for (const char* name : {"fan3", "fan5", "fan6"}) {
    const int sectors = name[3] - '0';
    ControlMesh fan = oracle::fan_mesh(sectors, 3, 3);
    oracle::jitter(fan, 0.8, 3);
    cases.push_back({name, fan, 0.1});
  }
  for (auto& [name, mesh, mm] : cases) {
    for (Vec3& p : mesh.positions) p *= mm;
    const auto tenth_of_noise = [rough = tile_noise(8)](const Vec3& p) mutable { return smooth(p) + 0.005 * rough(p); };
    for (const double tolerance : {0.01, kTileTolerance, 1e-4}) {
      take(mesh, {smooth, tenth_of_noise}, kTileOutside, tolerance);
      std::size_t fitted = 0;
      for (const Vec3& size : {Vec3(16, 16, 16), Vec3(8, 8, 8), Vec3(32, 16, 8)}) {
        for (const Box3& box : boxes(size)) {
          if (fit(fitter_->particles().enter(box, voxels_in(box), {}), box) != Outcome::kFits) continue;
          ++fitted;
          ASSERT_LE(error_in(box), 1) << name << " at " << box.min().transpose();
        }
      }
      EXPECT_GT(fitted, tolerance == 0.01 ? 10u : 0u) << name;
    }
  }
}

TEST_F(TileFitterTest, HalvesWhatIsNotInOnePatchIfAllIsToBeProved) {
  ControlMesh fan = oracle::fan_mesh(5, 3, 3);
  for (Vec3& p : fan.positions) p *= 0.1;
  spec_.proved = true;
  take(fan, {smooth}, kTileOutside, 0.01);
  std::size_t fitted = 0, halved = 0;
  for (const Box3& box : boxes(Vec3(8, 8, 8))) {
    TileParticles& particles = fitter_->particles();
    const TileParticles::Range found = particles.enter(box, voxels_in(box), {});
    if (!found.known || found.first == found.end) continue;
    const Outcome outcome = fit(found, box);
    const auto members = particles.members(found);
    if (std::ranges::all_of(members, [&](std::uint32_t m) { return particles[m].one_patch; })) {
      fitted += outcome == Outcome::kFits;
    } else {
      ++halved;
      EXPECT_EQ(outcome, Outcome::kHalve);
    }
  }
  EXPECT_GT(fitted, 5u);
  EXPECT_GT(halved, 5u);
}

TEST_F(TileFitterTest, HalvesWhatBendsAndGivesUpNoise) {
  take(bent_box(0), {smooth, [](const Vec3& p) { return std::sin(2 * p.x()); }});
  const Box3 box(Vec3(16, 8, 16), Vec3(63, 47, 31));
  EXPECT_EQ(fit(fitter_->particles().enter(box, voxels_in(box), {}), box), Outcome::kHalve);
  take(bent_box(), {tile_noise(5)}, kTileOutside, 1e-7);
  for (const Box3& part : {box, Box3(Vec3(16, 8, 16), Vec3(31, 23, 31))}) {
    EXPECT_EQ(fit(fitter_->particles().enter(part, voxels_in(part), {}), part), Outcome::kHopeless);
  }
}

TEST_F(TileFitterTest, GivesUpWhereNoCellIs) {
  take(bent_box(), {smooth});
  const Box3 box(Vec3(-60, -60, -60), Vec3(-40, -40, -40));
  const TileParticles::Range found = fitter_->particles().enter(box, voxels_in(box), {});
  EXPECT_TRUE(found.known);
  EXPECT_EQ(found.first, found.end);
  EXPECT_EQ(fit(found, box), Outcome::kHopeless);
  EXPECT_FALSE(fitter_->particles().near(found, box.center()));
}

TEST_F(TileFitterTest, DoesNotLookAtMoreParticlesThanVoxelsAreWorth) {
  take(bent_box(), {smooth});
  const Box3 box(Vec3(0, 0, 0), Vec3(95, 65, 15));
  const TileParticles::Range found = fitter_->particles().enter(box, 400, {});
  EXPECT_FALSE(found.known);
  EXPECT_EQ(fit(found, box), Outcome::kHalve);
  EXPECT_FALSE(fitter_->particles().near(found, box.center()));
  EXPECT_TRUE(fitter_->particles().enter(box, voxels_in(box), {}).known) << "nothing is left of the first";
}

// Cells of some thousand voxels in boxes of a hundred.
TEST_F(TileFitterTest, LooksAtPartsOfCellsThatAreLargeBesideABox) {
  ControlMesh mesh = oracle::box_mesh(3, 2, 2, 3);
  oracle::jitter(mesh, 0.3, 2);
  take(mesh, {smooth});
  const Box3 box(Vec3(40, 20, 30), Vec3(47, 27, 37));
  const TileParticles::Range found = fitter_->particles().enter(box, voxels_in(box), {});
  ASSERT_TRUE(found.known);
  ASSERT_EQ(fit(found, box), Outcome::kFits);
  EXPECT_LE(error_in(box), 1);
  const Vec3 length = Vec3::Constant(2).cwiseQuotient(fitter_->frame().scale);
  EXPECT_LT(length.maxCoeff(), 30) << "voxels, of a cell's 33";
}

// What meets a row may stick out by two of its voxels, however small it is. Cells were halved to nothing where that is
// more than the box is long: slicing a ball of 343 cells with rows of 8 mm took eleven times as long.
TEST_F(TileFitterTest, HalvesNoCellsForTheSakeOfAVoxelThatIsLong) {
  ControlMesh mesh = bent_box();
  for (Vec3& p : mesh.positions) p *= 11;
  take(std::move(mesh), {smooth}, kTileOutside, kTileTolerance, {0.2, 8.3, 1.3});
  const GridExtent& extent = spec_.grid.extent;
  const double row = extent.rows / 2, layer = extent.layers / 2;
  for (double column = 0; column + 32 < extent.columns; column += 32) {
    const Box3 box(Vec3(column, row, layer), Vec3(column + 31, row, layer + 3));
    const TileParticles::Range found = fitter_->particles().enter(box, 1 << 20, {});
    EXPECT_TRUE(found.known) << column;
    EXPECT_LT(fitter_->particles().members(found).size(), 200u) << column;
    fitter_->particles().leave(found);
  }
}

// Halves see what whole boxes hold, not only some of it, and in the same places as if nothing had come before.
TEST_F(TileFitterTest, EntersHalvesOfABox) {
  take(bent_box(), {smooth});
  const Box3 box(Vec3(16, 8, 16), Vec3(63, 39, 31));
  const TileParticles::Range whole = fitter_->particles().enter(box, voxels_in(box), {});
  ASSERT_TRUE(whole.known);
  for (const double x : {16, 40}) {
    const Box3 half(Vec3(x, 8, 16), Vec3(x + 23, 39, 31));
    const TileParticles::Range inside = fitter_->particles().enter(half, voxels_in(half), whole);
    ASSERT_TRUE(inside.known);
    EXPECT_EQ(inside.first, whole.end);
    EXPECT_LT(inside.end - inside.first, whole.end - whole.first);
    EXPECT_NE(fit(inside, half), Outcome::kHopeless);
    const Box3 quarter(half.min(), Vec3(half.max().x(), 23, 31));
    const TileParticles::Range deeper = fitter_->particles().enter(quarter, voxels_in(quarter), inside);
    ASSERT_TRUE(deeper.known);
    ASSERT_EQ(fit(deeper, quarter), Outcome::kFits);
    EXPECT_LE(error_in(quarter), 1);
    fitter_->particles().leave(deeper);
    fitter_->particles().leave(inside);
  }
  ASSERT_NE(fit(whole, box), Outcome::kHopeless) << "its own are still there";
}

TEST_F(TileFitterTest, StartsAnewAfterBoxesThatWereNeverLeft) {
  take(bent_box(), {smooth});
  const Box3 box(Vec3(16, 8, 16), Vec3(31, 23, 31)), other(Vec3(48, 24, 16), Vec3(63, 39, 31));
  ASSERT_EQ(fit(fitter_->particles().enter(box, voxels_in(box), {}), box), Outcome::kFits);
  const CubicPolynomial expected = fitter_->polynomials()[0];
  const TileParticles::Range there = fitter_->particles().enter(other, voxels_in(other), {});
  fitter_->particles().enter(Box3(other.min(), other.center()), 2000, there);
  const TileParticles::Range again = fitter_->particles().enter(box, voxels_in(box), {});
  EXPECT_EQ(again.first, 0u);
  ASSERT_EQ(fit(again, box), Outcome::kFits);
  EXPECT_EQ(fitter_->polynomials()[0], expected);
}

TEST_F(TileFitterTest, RefusesSteepPolynomialsBesideTheBoundaryOnly) {
  const auto linear = [](const Vec3& p) { return p.x() / 16; };
  const Box3 beside(Vec3(0, 24, 16), Vec3(15, 39, 31)), inside(Vec3(40, 24, 16), Vec3(55, 39, 31));
  const Box3 at_end(Vec3(74, 24, 16), Vec3(89, 39, 31));
  ControlMesh all_in_bricks = bent_box(0);
  oracle::sharpen_by_cells(all_in_bricks, 1);
  for (const ControlMesh& mesh : {bent_box(0), all_in_bricks}) {
    for (const bool proved : {false, true}) {
      for (const auto& [outside_mm, expected] : {std::pair(0.01, Outcome::kFits), std::pair(0.02, Outcome::kHalve)}) {
        spec_.proved = proved;
        take(mesh, {linear}, outside_mm);
        EXPECT_EQ(fit(fitter_->particles().enter(beside, voxels_in(beside), {}), beside), expected);
        EXPECT_EQ(fit(fitter_->particles().enter(at_end, voxels_in(at_end), {}), at_end), expected);
        EXPECT_EQ(fit(fitter_->particles().enter(inside, voxels_in(inside), {}), inside), Outcome::kFits);
      }
    }
  }
}

// So curved that a corner of the tile is steeper than the places where slopes are looked at by samples.
TEST_F(TileFitterTest, RefusesWhatMayBeSteepAnywhereIfAllIsToBeProved) {
  const auto cubic = [](const Vec3& p) { return std::pow(p.x() / 9, 3) * p.y() / 8; };
  const Box3 beside(Vec3(0, 24, 16), Vec3(15, 39, 31));
  std::size_t fits_by_samples = 0, fits_by_proof = 0;
  for (double outside_mm = 1e-3; outside_mm < 10; outside_mm *= 1.2) {
    std::array<bool, 2> fits;
    for (const bool proved : {false, true}) {
      spec_.proved = proved;
      take(bent_box(0), {cubic}, outside_mm, 0.01);
      fits[proved] = fit(fitter_->particles().enter(beside, voxels_in(beside), {}), beside) == Outcome::kFits;
    }
    EXPECT_LE(fits[1], fits[0]) << outside_mm;
    fits_by_samples += fits[0];
    fits_by_proof += fits[1];
  }
  EXPECT_GT(fits_by_proof, 0u);
  EXPECT_GT(fits_by_samples, fits_by_proof);
}

TEST_F(TileFitterTest, KnowsAParameterNearAVoxel) {
  take(bent_box(), {smooth});
  LimitEvaluator evaluator(*solid_);
  const Placement voxel_of_world = voxel_of_mesh(spec_.placement, spec_.grid);
  const Box3 box(Vec3(16, 8, 16), Vec3(63, 47, 31));
  const TileParticles::Range found = fitter_->particles().enter(box, voxels_in(box), {});
  for (const Vec3& voxel : {Vec3(16, 8, 16), Vec3(30, 30, 20), Vec3(63, 47, 31)}) {
    const std::optional<CellParam> near = fitter_->particles().near(found, voxel);
    ASSERT_TRUE(near);
    EXPECT_LT((voxel_of_world * evaluator.geo(*near) - voxel).norm(), 9) << "a cell's size, about";
  }
}

}  // namespace
}  // namespace ccslice
