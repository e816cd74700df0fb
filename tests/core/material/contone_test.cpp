// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/material/contone.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace ccslice {
namespace {

using testing::ElementsAre;

PlaneSpec channel_plane(SampleType type, std::optional<ValueRange> range = {}) {
  PlaneSpec spec;
  spec.content = PlaneContent::kChannel;
  spec.channel = 1;
  spec.sample_type = type;
  spec.range = range;
  return spec;
}

TEST(Quantize, MapsTheEndsOfTheRangeToTheEndsOfTheSamples) {
  for (const std::uint32_t largest : {255u, 65535u}) {
    EXPECT_EQ(quantize(-3, {-3, 5}, largest), 0u);
    EXPECT_EQ(quantize(5, {-3, 5}, largest), largest);
  }
}

TEST(Quantize, RoundsHalvesUp) {
  EXPECT_EQ(quantize(0.5, {0, 255}, 255), 1u);
  EXPECT_EQ(quantize(1.5, {0, 255}, 255), 2u);
  EXPECT_EQ(quantize(2.5, {0, 255}, 255), 3u);
  EXPECT_EQ(quantize(std::nextafter(2.5, 0.0), {0, 255}, 255), 2u);
  EXPECT_EQ(quantize(254.5, {0, 255}, 255), 255u);
  EXPECT_EQ(quantize(0.5, {0, 1}, 65535), 32768u);
}

TEST(Quantize, ClampsWhatLiesOutside) {
  EXPECT_EQ(quantize(-1e-9, {0, 1}, 255), 0u);
  EXPECT_EQ(quantize(-7, {0, 1}, 255), 0u);
  EXPECT_EQ(quantize(1.01, {0, 1}, 255), 255u);
  EXPECT_EQ(quantize(std::numeric_limits<double>::infinity(), {0, 1}, 65535), 65535u);
  EXPECT_EQ(quantize(-std::numeric_limits<double>::infinity(), {0, 1}, 65535), 0u);
  EXPECT_EQ(quantize(1e300, {0, std::numeric_limits<double>::denorm_min()}, 255), 255u);
}

TEST(Quantize, MapsAConstantChannelToZero) {
  EXPECT_EQ(quantize(4, {4, 4}, 255), 0u);
  EXPECT_EQ(quantize(std::nextafter(4.0, 5.0), {4, 4}, 65535), 0u);
}

TEST(Quantize, IsMonotoneAndOntoOverTheWholeRange) {
  std::uint32_t previous = 0;
  for (int i = 0; i <= 65535; ++i) {
    const std::uint32_t sample = quantize(2.0 + 3.0 * i / 65535, {2, 5}, 65535);
    ASSERT_EQ(sample, static_cast<std::uint32_t>(i));
    ASSERT_GE(sample, previous);
    previous = sample;
  }
}

TEST(ValueRangeOfAPlane, DefaultsToTheChannels) {
  const ChannelRange channel{"stiffness", -2, 6};
  EXPECT_EQ(value_range(channel_plane(SampleType::kUint8), channel).min, -2);
  EXPECT_EQ(value_range(channel_plane(SampleType::kUint8), channel).max, 6);
  EXPECT_EQ(value_range(channel_plane(SampleType::kUint8, ValueRange{0, 1}), channel).max, 1);
}

TEST(ContonePlane, HoldsBytes) {
  ContonePlane plane(channel_plane(SampleType::kUint8), {"a", 0, 255});
  plane.clear(2, 2);
  plane.set(3, std::vector<double>{99, 7.5});
  plane.copy(3, 0);
  const SampleImage image = plane.image();
  EXPECT_EQ(image.width, 2u);
  EXPECT_EQ(image.height, 2u);
  EXPECT_THAT(image.samples, ElementsAre(8, 0, 0, 8));
}

TEST(ContonePlane, HoldsLittleEndianWords) {
  ContonePlane plane(channel_plane(SampleType::kUint16), {"a", 0, 65535});
  plane.clear(3, 1);
  plane.set(1, std::vector<double>{99, 0x1234});
  plane.copy(1, 2);
  EXPECT_THAT(plane.image().samples, ElementsAre(0, 0, 0x34, 0x12, 0x34, 0x12));
}

TEST(ContonePlane, HoldsFloatsAsTheyAre) {
  ContonePlane plane(channel_plane(SampleType::kFloat32), {"a", 0, 1});
  plane.clear(2, 1);
  plane.set(1, std::vector<double>{99, -12.25});
  float values[2];
  ASSERT_EQ(plane.image().samples.size(), sizeof values);
  std::memcpy(values, plane.image().samples.data(), sizeof values);
  EXPECT_EQ(values[0], 0.0f);
  EXPECT_EQ(values[1], -12.25f);
}

TEST(ContonePlane, ForgetsTheLayerBefore) {
  ContonePlane plane(channel_plane(SampleType::kUint8), {"a", 0, 255});
  plane.clear(2, 1);
  plane.set(0, std::vector<double>{0, 200});
  plane.clear(2, 1);
  EXPECT_THAT(plane.image().samples, ElementsAre(0, 0));
}

}  // namespace
}  // namespace ccslice
