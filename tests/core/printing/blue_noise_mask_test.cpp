// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/blue_noise_mask.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/output/encode.h"
#include "tests/support/power_spectrum.h"

namespace ccslice {
namespace {

std::vector<float> thresholds_of(const BlueNoiseMask& mask) {
  std::vector<float> all;
  for (std::uint32_t z = 0; z < kMaskEdge; ++z) {
    for (std::uint32_t y = 0; y < kMaskEdge; ++y) {
      const auto row = mask.row(y, z);
      all.insert(all.end(), row.begin(), row.end());
    }
  }
  return all;
}

TEST(BlueNoiseMask, HasEachThresholdOnce) {
  std::vector<float> thresholds = thresholds_of(*shared_mask({1, 1, 1}));
  std::sort(thresholds.begin(), thresholds.end());
  for (std::size_t i = 0; i < kMaskVoxels; ++i) ASSERT_EQ(thresholds[i], (static_cast<float>(i) + 0.5f) * 0x1p-18f);
}

// The checksum pins the bytes: layers of different builds and machines must agree.
TEST(BlueNoiseMask, IsTheSameEverywhere) {
  const std::vector<float> thresholds = thresholds_of(*shared_mask(voxel_shape(25.4 / 600, 25.4 / 300, 0.027)));
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(thresholds.data());
  EXPECT_EQ(crc32_of({bytes, thresholds.size() * sizeof(float)}), 4241190348u);
}

TEST(BlueNoiseMask, IsEvenInMillimetresWhateverTheShapeOfVoxels) {
  for (const auto& pitch :
       {std::array{0.1, 0.1, 0.1}, std::array{25.4 / 600, 25.4 / 300, 0.014}, std::array{0.02, 0.16, 0.05}}) {
    const std::vector<float> thresholds = thresholds_of(*shared_mask(voxel_shape(pitch[0], pitch[1], pitch[2])));
    VoxelPattern pattern{{kMaskEdge, kMaskEdge, kMaskEdge}, pitch, {}};
    for (const float threshold : thresholds) pattern.values.push_back(threshold < 0.3f ? 1 : 0);
    const double edge = std::cbrt(pitch[0] * pitch[1] * pitch[2]);
    EXPECT_LT(mean_power_below(pattern, 0.15 / edge), 0.05) << pitch[0] << " " << pitch[1] << " " << pitch[2];
  }
}

TEST(VoxelShape, ForgetsTheSizeAndKeepsTheRatio) {
  const VoxelShape small = voxel_shape(0.01, 0.02, 0.005), large = voxel_shape(1, 2, 0.5);
  EXPECT_EQ(small.x, large.x);
  EXPECT_EQ(small.y, large.y);
  EXPECT_EQ(small.z, large.z);
  EXPECT_NEAR(small.y / small.z, 4, 0.1);
  EXPECT_EQ(voxel_shape(1e-4, 1e3, 1).y, 8);
}

// A mask of 100 x 0.5 x 0.5 mm as it is would take 20 s.
TEST(VoxelShape, IsLessSlenderForVoxelsThatAreLongAlongX) {
  for (const auto& [x, y, z] : {std::array{100.0, 0.5, 0.5}, {1e3, 1e-4, 1e-4}, {0.5, 0.05, 0.1}}) {
    const VoxelShape shape = voxel_shape(x, y, z);
    EXPECT_NEAR(shape.x, 2, 1e-9);
    EXPECT_GE(shape.y * shape.z, 0.49);
    EXPECT_NEAR(std::log(shape.y / shape.z) * std::log(x / z), std::log(y / z) * std::log(shape.x / shape.z), 0.05);
  }
  EXPECT_NEAR(voxel_shape(0.1, 0.05, 0.05).x, std::cbrt(4), 0.02) << "others keep their shape";
}

TEST(SharedMask, IsMadeOnceForAllThreads) {
  std::vector<std::shared_ptr<const BlueNoiseMask>> masks(4);
  std::vector<std::thread> threads;
  for (auto& mask : masks) threads.emplace_back([&mask] { mask = shared_mask({2, 1, 0.5}); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& mask : masks) EXPECT_EQ(mask, masks.front());
}

TEST(SharedMask, StopsOnACancelAndIsMadeTheNextTime) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW(shared_mask({0.5, 1, 2}, cancel), Error);
  EXPECT_NE(shared_mask({0.5, 1, 2}), nullptr);
}

}  // namespace
}  // namespace ccslice
