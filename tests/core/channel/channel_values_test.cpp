// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/channel/channel_values.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/channel_functions.h"

namespace ccslice {
namespace {

TEST(ChannelValues, OfSourcesFollowFromThePointAndFromChannelsBeforeThem) {
  const ChannelSources sources = {
      std::make_shared<ChannelFunction>(ChannelRange{"height", 0, 10}, std::vector<std::string>{},
                                        [](const Vec3& world, const Vec3& mesh, std::span<const float>) {
                                          return static_cast<float>(world.z() - mesh.x());
                                        }),
      std::make_shared<ChannelFunction>(
          ChannelRange{"both", 0, 10}, std::vector<std::string>{"b", "height"},
          [](const Vec3&, const Vec3&, std::span<const float> inputs) { return inputs[0] + 10 * inputs[1]; })};
  const ChannelValues all({{"a", 0, 1}, {"b", 0, 1}}, sources);
  ASSERT_EQ(all.channels().size(), 4u);
  EXPECT_EQ(all.channels()[3].name, "both");
  std::array<double, 4> values = {1, 2, 0, 0};
  all.complete(Vec3(0, 0, 7), Vec3(4, 0, 0), values);
  EXPECT_EQ(values, (std::array<double, 4>{1, 2, 3, 32}));
}

TEST(ChannelValues, WithoutSourcesAreTheSolids) {
  const ChannelValues all({{"a", 0, 1}}, {});
  std::array<double, 1> values = {5};
  all.complete(Vec3::Zero(), Vec3::Zero(), values);
  EXPECT_EQ(values[0], 5);
}

}  // namespace
}  // namespace ccslice
