// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/unresolved_voxels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;

/// The whole solid is cell 7, whose channel is x + 100 y, unless it is nowhere.
class PlaneField final : public MaterialField {
 public:
  std::optional<InversionResult> invert(const Vec3&, const std::optional<CellParam>&) override { return std::nullopt; }
  std::optional<InversionResult> nearest(const Vec3& world) override {
    ++nearest_calls;
    if (nowhere) return std::nullopt;
    InversionResult result;
    result.at = {LimitCellId{7}, world};
    return result;
  }
  void mat(const CellParam& at, std::span<double> out) override { out[0] = at.uvw.x() + 100 * at.uvw.y(); }
  bool is_ambiguous(const Box3&) const override { return false; }
  std::size_t channel_count() const override { return 1; }

  bool nowhere = false;
  int nearest_calls = 0;
};

using Voxel = std::pair<std::uint32_t, std::uint32_t>;  // Row, column.

class UnresolvedVoxelsTest : public testing::Test {
 protected:
  UnresolvedVoxelsTest() : plane_(spec(), {"", -1e9, 1e9}, 0) { plane_.clear(lattice_.width, lattice_.height); }

  static PlaneSpec spec() {
    PlaneSpec spec;
    spec.content = PlaneContent::kChannel;
    spec.sample_type = SampleType::kFloat32;
    return spec;
  }

  LayerTarget target(const LayerWindow& window) {
    const bool is_whole = window == window_of(lattice_);
    return {lattice_, 3.5, std::span(&plane_, 1), stats_, cancel_, window, window, is_whole};
  }
  LayerTarget target() { return target(window_of(lattice_)); }

  float sample(std::uint32_t x, std::uint32_t y) const {
    float value;
    std::memcpy(&value, &plane_.image().samples[4 * (std::size_t{lattice_.width} * y + x)], sizeof value);
    return value;
  }

  const LayerLattice lattice_{0, 0, 0.25, 0.375, 40, 30};
  ContonePlane plane_;
  LayerStats stats_;
  CancellationToken cancel_ = CancellationToken::make();
  PlaneField field_;
  UnresolvedVoxels unresolved_;
};

TEST_F(UnresolvedVoxelsTest, TakeTheSamplesOfTheNearestSolvedVoxel) {
  std::mt19937 random(kSeed);
  for (const std::uint32_t solved_of_ten : {9u, 5u, 1u}) {
    std::vector<VoxelRun> spans;
    std::map<Voxel, float> solved;
    std::vector<Voxel> open;
    unresolved_.clear();
    for (std::uint32_t y = 0; y < lattice_.height; ++y) {
      const auto begin = static_cast<std::uint32_t>(random() % 10),
                 end = begin + 5 + static_cast<std::uint32_t>(random() % 25);
      spans.push_back({y, begin, end});
      for (std::uint32_t x = begin; x < end; ++x) {
        if (random() % 10 < solved_of_ten) {
          const auto value = static_cast<float>(random() % 100000);
          solved[{y, x}] = value;
          plane_.set(std::size_t{lattice_.width} * y + x, std::array{double{value}});
        } else {
          unresolved_.add(y, x);
          open.emplace_back(y, x);
        }
      }
    }
    const std::uint64_t before = stats_.voxels_unresolved;
    ASSERT_EQ(unresolved_.fill(field_, spans, target()), WindowOutcome::kComplete);
    EXPECT_EQ(stats_.voxels_unresolved - before, open.size());
    EXPECT_EQ(field_.nearest_calls, 0);
    for (const auto& [y, x] : open) {
      // In map's order: by row, then by column.
      double least = 1e9;
      float expected = 0;
      for (const auto& [voxel, value] : solved) {
        const double dy = 0.375 * (double(voxel.first) - y), dx = 0.25 * (double(voxel.second) - x);
        const double distance = dx * dx + dy * dy;
        if (distance < least) {
          least = distance;
          expected = value;
        }
      }
      ASSERT_EQ(sample(x, y), expected) << "seed " << kSeed << " at " << x << ' ' << y;
    }
    for (const auto& [voxel, value] : solved) EXPECT_EQ(sample(voxel.second, voxel.first), value);
  }
}

TEST_F(UnresolvedVoxelsTest, TakeTheSolidsNearestParameterIfTheLayerHasNone) {
  for (const std::uint32_t x : {3u, 4u, 7u}) unresolved_.add(2, x);
  unresolved_.add(5, 8);
  const std::vector<VoxelRun> spans = {{2, 3, 5}, {2, 7, 8}, {5, 8, 9}};
  ASSERT_EQ(unresolved_.fill(field_, spans, target()), WindowOutcome::kComplete);
  EXPECT_EQ(field_.nearest_calls, 4);
  for (const auto& [y, x] : {Voxel{2, 3}, {2, 4}, {2, 7}, {5, 8}}) {
    EXPECT_NEAR(sample(x, y), 0.25 * (x + 0.5) + 100 * 0.375 * (y + 0.5), 1e-4);
  }
  EXPECT_EQ(stats_.voxels_unresolved, 4u);
  field_.nowhere = true;
  EXPECT_THROW((void)unresolved_.fill(field_, spans, target()), Error);
}

TEST_F(UnresolvedVoxelsTest, AreLeftToAWholeLayerWhereAWindowHoldsSome) {
  unresolved_.add(2, 3);
  const std::vector<VoxelRun> spans = {{2, 3, 9}};
  EXPECT_EQ(unresolved_.fill(field_, spans, target({3, 2, 5, 5})), WindowOutcome::kNeedsWholeLayer);
  EXPECT_EQ(stats_.voxels_unresolved, 0u);
  EXPECT_EQ(sample(3, 2), 0);
  EXPECT_EQ(unresolved_.fill(field_, spans, target({4, 2, 5, 5})), WindowOutcome::kComplete);
  EXPECT_EQ(unresolved_.fill(field_, spans, target({3, 3, 5, 5})), WindowOutcome::kComplete);
  EXPECT_EQ(stats_.voxels_unresolved, 0u);
  unresolved_.clear();
  EXPECT_EQ(unresolved_.fill(field_, spans, target({3, 2, 5, 5})), WindowOutcome::kComplete);
}

TEST_F(UnresolvedVoxelsTest, CanBeCancelled) {
  unresolved_.add(2, 3);
  cancel_.cancel();
  EXPECT_THROW((void)unresolved_.fill(field_, std::vector<VoxelRun>{{2, 3, 9}}, target()), Error);
  EXPECT_THROW((void)unresolved_.fill(field_, std::vector<VoxelRun>{{2, 3, 4}}, target()), Error);
}

}  // namespace
}  // namespace ccslice
