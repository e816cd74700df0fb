// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/material_pass.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

#include "core/base/error.h"

namespace ccslice {
namespace {

// The identity as a solid: parameters are world points, materials their coordinates.
class IdentityField final : public MaterialField {
 public:
  std::optional<InversionResult> invert(const Vec3& world, const std::optional<CellParam>& hint) override {
    points.push_back(world);
    hints.push_back(hint ? std::optional<Vec3>(hint->uvw) : std::nullopt);
    if (on_invert) on_invert();
    if (unreachable && unreachable(world)) return std::nullopt;
    return InversionResult{{{}, world}, 1e-9 * static_cast<double>(points.size()), 2, !hint};
  }
  std::optional<InversionResult> nearest(const Vec3& world) override {
    ++nearest_calls;
    if (nothing_anywhere) return std::nullopt;
    return InversionResult{{{}, world + Vec3(100, 0, 0)}, 100, 9, true};
  }
  void mat(const CellParam& at, std::span<double> out) override {
    for (int i = 0; i < 3; ++i) out[i] = at.uvw[i];
  }
  bool is_ambiguous(const Box3&) const override { return false; }
  std::size_t channel_count() const override { return 3; }

  std::function<bool(const Vec3&)> unreachable;
  std::function<void()> on_invert;
  bool nothing_anywhere = false;
  int nearest_calls = 0;
  std::vector<Vec3> points;
  std::vector<std::optional<Vec3>> hints;
};

class MaterialPassTest : public testing::Test {
 protected:
  MaterialPassTest() {
    lattice_ = {-1, 10, 0.5, 2, 40, 8};
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      PlaneSpec spec;
      spec.content = PlaneContent::kChannel;
      spec.sample_type = SampleType::kFloat32;
      planes_.emplace_back(spec, ChannelRange{"", 0, 1}, channel);
    }
  }

  void run(const std::vector<VoxelRun>& spans, const CancellationToken& cancel = {}) {
    for (ContonePlane& plane : planes_) plane.clear(lattice_.width, lattice_.height);
    stats_ = {};
    const LayerWindow all = window_of(lattice_);
    EXPECT_EQ(MaterialPass(field_).run({lattice_, 7.0, planes_, stats_, cancel, all, all}, spans),
              WindowOutcome::kComplete);
  }

  WindowOutcome run_in(const LayerWindow& window, const LayerWindow& counted, const std::vector<VoxelRun>& spans) {
    const bool is_whole = window == window_of(lattice_);
    return MaterialPass(field_).run({lattice_, 7.0, planes_, stats_, {}, window, counted, is_whole}, spans);
  }

  float sample(int plane, std::uint32_t x, std::uint32_t y) const {
    float value;
    std::memcpy(&value, &planes_[plane].image().samples[4 * (lattice_.width * y + x)], sizeof value);
    return value;
  }

  double x_mm(std::uint32_t x) const { return -1 + (x + 0.5) * 0.5; }
  double y_mm(std::uint32_t y) const { return 10 + (y + 0.5) * 2; }

  IdentityField field_;
  LayerLattice lattice_;
  std::vector<ContonePlane> planes_;
  LayerStats stats_;
};

TEST_F(MaterialPassTest, EvaluatesVoxelCentresAndLeavesTheOutsideZero) {
  const std::vector<VoxelRun> spans = {{1, 3, 6}, {4, 0, 2}, {4, 38, 40}};
  run(spans);
  for (std::uint32_t y = 0; y < lattice_.height; ++y) {
    for (std::uint32_t x = 0; x < lattice_.width; ++x) {
      const bool inside = (y == 1 && x >= 3 && x < 6) || (y == 4 && (x < 2 || x >= 38));
      EXPECT_EQ(sample(0, x, y), inside ? float(x_mm(x)) : 0.0f);
      EXPECT_EQ(sample(1, x, y), inside ? float(y_mm(y)) : 0.0f);
      EXPECT_EQ(sample(2, x, y), inside ? 7.0f : 0.0f);
    }
  }
  EXPECT_EQ(field_.points.size(), 7u);
  EXPECT_EQ(stats_.voxels_full, 3u);
  EXPECT_EQ(stats_.voxels_coherent, 4u);
  EXPECT_EQ(stats_.voxels_unresolved, 0u);
  EXPECT_DOUBLE_EQ(stats_.max_residual_mm, 7e-9);
}

TEST_F(MaterialPassTest, HintsAreTheLeftNeighbourThenTheNearestEndOfARun) {
  run({{1, 3, 5}, {2, 4, 6}, {2, 20, 21}, {2, 38, 39}, {4, 4, 5}});
  const auto x_of = [&](std::size_t i) { return field_.hints[i] ? (*field_.hints[i])[0] : -99; };
  EXPECT_EQ(x_of(0), -99);      // First of all.
  EXPECT_EQ(x_of(1), x_mm(3));  // The left neighbour.
  EXPECT_EQ(x_of(2), x_mm(4));  // Straight below.
  EXPECT_EQ(x_of(3), x_mm(4));  // The left neighbour again, of this row.
  EXPECT_EQ((*field_.hints[3])[1], y_mm(2));
  EXPECT_EQ(x_of(4), x_mm(5));  // The end of the run before, 15 columns away.
  EXPECT_EQ(x_of(5), -99);      // 18 columns away: too far.
  EXPECT_EQ(x_of(6), -99);      // The row below is empty.
}

TEST_F(MaterialPassTest, AfterAGapTheLastSolvedVoxelIsTheHint) {
  field_.unreachable = [&](const Vec3& p) { return p.y() == y_mm(2) && p.x() == x_mm(4); };
  run({{1, 3, 8}, {2, 3, 8}});
  EXPECT_EQ((*field_.hints[7])[0], x_mm(3));  // Of voxel (5, 2), right of the gap.
  EXPECT_EQ((*field_.hints[7])[1], y_mm(2));
}

TEST_F(MaterialPassTest, UnresolvedVoxelsTakeTheNearestSolvedSample) {
  field_.unreachable = [&](const Vec3& p) { return p.y() == y_mm(2) && p.x() > x_mm(4) && p.x() < x_mm(30); };
  run({{2, 3, 31}, {3, 20, 21}});
  EXPECT_EQ(stats_.voxels_unresolved, 25u);
  EXPECT_EQ(stats_.voxels_full + stats_.voxels_coherent, 4u);
  EXPECT_EQ(sample(0, 5, 2), float(x_mm(4)));
  EXPECT_EQ(sample(0, 29, 2), float(x_mm(30)));
  EXPECT_EQ(sample(0, 19, 2), float(x_mm(20)));
  EXPECT_EQ(sample(1, 19, 2), float(y_mm(3)));
  EXPECT_EQ(sample(0, 20, 2), float(x_mm(20)));
  EXPECT_EQ(field_.nearest_calls, 0);
}

TEST_F(MaterialPassTest, StartsAnewAtEvery64thRow) {
  lattice_.height = 140;
  run({{62, 3, 4}, {63, 3, 4}, {64, 3, 4}, {65, 3, 4}, {127, 3, 4}, {128, 3, 4}});
  std::vector<bool> hinted;
  for (const auto& hint : field_.hints) hinted.push_back(hint.has_value());
  EXPECT_EQ(hinted, (std::vector<bool>{false, true, false, true, false, false}));
}

TEST_F(MaterialPassTest, OfAWindowSetsAndCountsItsVoxelsOnly) {
  run({{1, 3, 9}, {2, 3, 9}});
  const float inside = sample(0, 5, 2);
  const LayerWindow window{4, 2, 3, 4}, counted{5, 2, 1, 1};
  for (ContonePlane& plane : planes_) plane.clear(window.columns, window.rows);
  stats_ = {};
  const std::vector<VoxelRun> spans = {{1, 3, 9}, {2, 3, 9}};
  EXPECT_EQ(run_in(window, counted, spans), WindowOutcome::kComplete);
  EXPECT_EQ(stats_.voxels_coherent + stats_.voxels_full, 1u);
  float there;
  std::memcpy(&there, &planes_[0].image().samples[4 * window.index(5, 2)], sizeof there);
  EXPECT_EQ(there, inside);
  field_.unreachable = [&](const Vec3& p) { return p.x() == x_mm(3); };
  EXPECT_EQ(run_in(window, counted, spans), WindowOutcome::kComplete) << "outside";
  field_.unreachable = [&](const Vec3& p) { return p.x() == x_mm(6) && p.y() == y_mm(2); };
  EXPECT_EQ(run_in(window, counted, spans), WindowOutcome::kNeedsWholeLayer) << "the nearest solved one may be outside";
}

TEST_F(MaterialPassTest, ALayerWithNothingSolvedTakesTheNearestOfTheSolid) {
  field_.unreachable = [](const Vec3&) { return true; };
  run({{2, 3, 5}});
  EXPECT_EQ(stats_.voxels_unresolved, 2u);
  EXPECT_EQ(stats_.max_residual_mm, 0.0);
  EXPECT_EQ(field_.nearest_calls, 2);
  EXPECT_EQ(sample(0, 3, 2), float(x_mm(3) + 100));
}

TEST_F(MaterialPassTest, NeverLeavesAVoxelWithoutMaterialSilently) {
  field_.unreachable = [](const Vec3&) { return true; };
  field_.nothing_anywhere = true;
  try {
    run({{2, 3, 5}});
    FAIL() << "passed";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInternal);
    EXPECT_THAT(error.what(), testing::HasSubstr("(3, 2)"));
  }
}

TEST_F(MaterialPassTest, ALayerKnowsNothingOfTheOneBefore) {
  MaterialPass pass(field_);
  const std::vector<VoxelRun> low = {{1, 3, 5}}, high = {{2, 3, 5}};
  for (ContonePlane& plane : planes_) plane.clear(lattice_.width, lattice_.height);
  const LayerWindow all = window_of(lattice_);
  EXPECT_EQ(pass.run({lattice_, 7, planes_, stats_, {}, all, all}, low), WindowOutcome::kComplete);
  EXPECT_EQ(pass.run({lattice_, 8, planes_, stats_, {}, all, all}, high), WindowOutcome::kComplete);
  EXPECT_EQ(field_.hints[2], std::nullopt);
}

TEST_F(MaterialPassTest, StopsWithinAFewHundredVoxelsOfACancel) {
  lattice_.width = 100'000;
  const CancellationToken cancel = CancellationToken::make();
  field_.on_invert = [&] {
    if (field_.points.size() == 1000) cancel.cancel();
  };
  EXPECT_THROW(run({{0, 0, 100'000}}, cancel), Error);
  EXPECT_LE(field_.points.size(), 1256u);
}

}  // namespace
}  // namespace ccslice
