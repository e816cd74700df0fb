// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/patch_lanes.h"

#include <gtest/gtest.h>

#include <random>

namespace ccslice {
namespace {

TEST(PatchLanes, AgreeWithOneParameterAtATime) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-10, 10), u(-0.5, 1.5);
  constexpr std::size_t kChannels = 3;
  alignas(32) std::array<double, kPatchPoints> points;
  std::array<double, 64 * kChannels> channel_values;
  for (double& coordinate : points) coordinate = value(random);
  for (double& channel : channel_values) channel = value(random);
  const Patch patch{points.data(), channel_values.data()};
  std::array<Lanes, 3> uvw;
  for (Lanes& axis : uvw) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) axis[lane] = u(random);
  }
  const LaneBasis basis(uvw);
  const std::array<Lanes, 3> positions = patch_positions(patch, basis);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Vec3 at(uvw[0][lane], uvw[1][lane], uvw[2][lane]);
    const Vec3 expected = patch_position(patch, at);
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(positions[static_cast<std::size_t>(a)][lane], expected[a], 1e-12);
    std::array<double, kChannels> channels;
    patch_channels(patch, at, channels);
    for (std::size_t c = 0; c < kChannels; ++c) {
      EXPECT_NEAR(patch_channel(patch, c, kChannels, basis)[lane], channels[c], 1e-12);
    }
  }
}

}  // namespace
}  // namespace ccslice
