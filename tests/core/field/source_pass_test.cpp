// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/source_pass.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "tests/support/channel_functions.h"

namespace ccslice {
namespace {

class SourcePassTest : public testing::Test {
 protected:
  SourcePassTest() {
    for (const char* name : {"solid", "sum", "twice"}) {
      PlaneSpec& spec = specs_.emplace_back();
      spec.content = PlaneContent::kChannel;
      spec.channel = name;
      spec.sample_type = SampleType::kFloat32;
    }
  }

  /// The value of "twice" of each voxel of a window of the layer; "solid" is 1000 * row + column. -1 outside.
  std::vector<float> run(const LayerWindow& window, const std::vector<VoxelRun>& spans) {
    std::vector<ContonePlane> planes;
    for (PlaneSpec& spec : specs_) {
      spec.outside_sample = -1;
      const bool of_solid = spec.channel == "solid";
      planes.emplace_back(spec, ChannelRange{spec.channel, 0, 1e6},
                          of_solid ? std::optional<std::uint32_t>(0) : std::nullopt);
      planes.back().clear(window.columns, window.rows);
    }
    for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
      for (std::uint32_t x = window.first_column; x < window.end_column(); ++x) {
        planes[0].set(window.index(x, y), std::array{1000.0 * y + x});
      }
    }
    LayerStats stats;
    const CancellationToken cancel;
    SourcePass(std::array{UsedSource{sum_.get(), {}}, UsedSource{twice_.get(), {}}}, specs_, placement_)
        .run({lattice_, 7, planes, stats, cancel, window, window}, spans);
    std::vector<float> values(std::size_t{window.columns} * window.rows);
    std::memcpy(values.data(), planes[2].image().samples.data(), sizeof(float) * values.size());
    return values;
  }

  const LayerLattice lattice_{-1, 10, 0.5, 2, 40, 8};
  const Placement placement_ = [] {
    Placement placement = Placement::Identity();
    placement.translate(Vec3(3, 0, 5)).rotate(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
    return placement;
  }();
  const std::shared_ptr<const ChannelSource> sum_ = std::make_shared<ChannelFunction>(
      ChannelRange{"sum", 0, 1e6}, std::vector<std::string>{"solid"},
      [this](const Vec3& world, const Vec3& mesh, std::span<const float> inputs) {
        EXPECT_LT((placement_ * mesh - world).norm(), 1e-12);
        return inputs[0] + static_cast<float>(world.x() + 100 * world.y() + 10000 * world.z());
      });
  const std::shared_ptr<const ChannelSource> twice_ = std::make_shared<ChannelFunction>(
      ChannelRange{"twice", 0, 2e6}, std::vector<std::string>{"sum"},
      [](const Vec3&, const Vec3&, std::span<const float> inputs) { return 2 * inputs[0]; });
  std::vector<PlaneSpec> specs_;
};

TEST_F(SourcePassTest, FillsTheVoxelsInsideEachSourceAfterWhatItReads) {
  const LayerWindow all = window_of(lattice_);
  const std::vector<float> values = run(all, {{2, 3, 40}, {5, 0, 7}});
  for (std::uint32_t y = 0; y < lattice_.height; ++y) {
    for (std::uint32_t x = 0; x < lattice_.width; ++x) {
      const bool inside = (y == 2 && x >= 3) || (y == 5 && x < 7);
      const Vec3 centre = lattice_.centre(x, y, 7);
      const double expected = 2 * (1000.0 * y + x + centre.x() + 100 * centre.y() + 10000 * centre.z());
      EXPECT_NEAR(values[all.index(x, y)], inside ? expected : -1, 1e-6 * expected) << x << ", " << y;
    }
  }
}

TEST_F(SourcePassTest, HandsBoundsOn) {
  class Source final : public ChannelSource {
   public:
    const ChannelRange& range() const noexcept override { return range_; }
    void sample_row(const SourceRow& row, std::span<const std::span<const float>>,
                    std::span<float> values) const override {
      EXPECT_TRUE(std::ranges::equal(row.bounds, std::array{0.5f, 2.0f}));
      std::ranges::fill(values, 1.0f);
    }

   private:
    ChannelRange range_{"twice", 0, 9};
  } source;
  std::vector<ContonePlane> planes;
  for (const PlaneSpec& spec : specs_) {
    planes.emplace_back(spec, ChannelRange{spec.channel, 0, 9}, std::nullopt);
    planes.back().clear(lattice_.width, lattice_.height);
  }
  LayerStats stats;
  const LayerWindow all = window_of(lattice_);
  const std::vector<VoxelRun> spans = {{1, 0, 9}};
  SourcePass(std::array{UsedSource{&source, {0.5f, 2.0f}}}, specs_, placement_)
      .run({lattice_, 7, planes, stats, {}, all, all}, spans);
  std::vector<float> values(9);
  planes[2].read_values(all.index(0, 1), values);
  EXPECT_EQ(values, std::vector<float>(9, 1.0f));
}

TEST_F(SourcePassTest, GivesTheSameBitsInAnyWindow) {
  const LayerWindow all = window_of(lattice_), part{5, 2, 17, 4};
  const std::vector<VoxelRun> spans = {{1, 0, 9}, {2, 3, 40}, {3, 10, 12}, {5, 0, 7}};
  const std::vector<float> whole = run(all, spans), cropped = run(part, spans);
  for (std::uint32_t y = part.first_row; y < part.end_row(); ++y) {
    for (std::uint32_t x = part.first_column; x < part.end_column(); ++x) {
      EXPECT_EQ(cropped[part.index(x, y)], whole[all.index(x, y)]) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace ccslice
