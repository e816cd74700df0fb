// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/contone.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace ccslice {
namespace {

using testing::ElementsAre;

PlaneSpec channel_plane(SampleType type, std::optional<ValueRange> range = {}) {
  PlaneSpec spec;
  spec.content = PlaneContent::kChannel;
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
  ContonePlane plane(channel_plane(SampleType::kUint8), {"a", 0, 255}, 1);
  plane.clear(2, 2);
  plane.set(3, std::vector<double>{99, 7.5});
  plane.copy(3, 0);
  const SampleImage image = plane.image();
  EXPECT_EQ(image.width, 2u);
  EXPECT_EQ(image.height, 2u);
  EXPECT_THAT(image.samples, ElementsAre(8, 0, 0, 8));
}

TEST(ContonePlane, HoldsLittleEndianWords) {
  ContonePlane plane(channel_plane(SampleType::kUint16), {"a", 0, 65535}, 1);
  plane.clear(3, 1);
  plane.set(1, std::vector<double>{99, 0x1234});
  plane.copy(1, 2);
  EXPECT_THAT(plane.image().samples, ElementsAre(0, 0, 0x34, 0x12, 0x34, 0x12));
}

TEST(ContonePlane, HoldsFloatsAsTheyAre) {
  ContonePlane plane(channel_plane(SampleType::kFloat32), {"a", 0, 1}, 1);
  plane.clear(2, 1);
  plane.set(1, std::vector<double>{99, -12.25});
  float values[2];
  ASSERT_EQ(plane.image().samples.size(), sizeof values);
  std::memcpy(values, plane.image().samples.data(), sizeof values);
  EXPECT_EQ(values[0], 0.0f);
  EXPECT_EQ(values[1], -12.25f);
}

TEST(ContonePlane, ForgetsTheLayerBefore) {
  ContonePlane plane(channel_plane(SampleType::kUint8), {"a", 0, 255}, 1);
  plane.clear(2, 1);
  plane.set(0, std::vector<double>{0, 200});
  plane.clear(2, 1);
  EXPECT_THAT(plane.image().samples, ElementsAre(0, 0));
}

TEST(ContonePlane, HoldsTheSampleForOutsideWhereNothingIsSet) {
  PlaneSpec spec = channel_plane(SampleType::kUint8);
  spec.outside_sample = 255;
  ContonePlane bytes(spec, {"a", 0, 255}, 1);
  spec.sample_type = SampleType::kUint16;
  spec.outside_sample = 0x1234;
  ContonePlane words(spec, {"a", 0, 65535}, 1);
  spec.sample_type = SampleType::kFloat32;
  spec.outside_sample = std::numeric_limits<double>::quiet_NaN();
  ContonePlane floats(spec, {"a", 0, 1}, 1);
  for (int layer = 0; layer < 2; ++layer) {
    for (ContonePlane* plane : {&bytes, &words, &floats}) {
      plane->clear(2, 1);
      plane->set(1, std::vector<double>{0, 0});
    }
    EXPECT_THAT(bytes.image().samples, ElementsAre(255, 0));
    EXPECT_THAT(words.image().samples, ElementsAre(0x34, 0x12, 0, 0));
    float values[2];
    std::memcpy(values, floats.image().samples.data(), sizeof values);
    EXPECT_TRUE(std::isnan(values[0]));
    EXPECT_EQ(values[1], 0.0f);
  }
}

class SetCubic : public testing::TestWithParam<SampleType> {
 protected:
  static double sample(const ContonePlane& plane, std::size_t index) {
    const std::span<const std::uint8_t> bytes = plane.image().samples;
    if (GetParam() == SampleType::kUint8) return bytes[index];
    if (GetParam() == SampleType::kUint16) return bytes[2 * index] + 256 * bytes[2 * index + 1];
    float value;
    std::memcpy(&value, &bytes[4 * index], sizeof value);
    return value;
  }

  /// How far samples of set_cubic() may be from those of set(): one step, or a float's rounding.
  static double step() { return GetParam() == SampleType::kFloat32 ? 1e-6 : 1; }
};

// Along rows of all lengths round the block's, both planes show the same, and voxels beside the row stay as they were.
TEST_P(SetCubic, AgreesWithSettingEachVoxel) {
  const std::array<double, 4> c = {0.55, 0.3, -0.25, 0.2};
  constexpr double kFirst = -0.9, kStep = 0.009;
  for (const bool ranged : {false, true}) {
    const bool integer = GetParam() != SampleType::kFloat32;
    const PlaneSpec spec =
        channel_plane(GetParam(), ranged && integer ? std::optional(ValueRange{0.2, 0.9}) : std::nullopt);
    for (std::uint32_t count = 1; count <= 200; ++count) {
      ContonePlane row(spec, {"a", -1, 2}, 1), each(spec, {"a", -1, 2}, 1);
      row.clear(210, 1);
      each.clear(210, 1);
      row.set_cubic(5, 0, count, kFirst, kStep, c);
      for (std::uint32_t k = 0; k < count; ++k) {
        const double t = kFirst + kStep * k;
        each.set(5 + k, std::vector<double>{99, ((c[3] * t + c[2]) * t + c[1]) * t + c[0]});
      }
      for (std::size_t x = 0; x < 210; ++x)
        ASSERT_NEAR(sample(row, x), sample(each, x), step()) << x << " of " << count;
    }
  }
}

// A plane that shows a millionth of what its channel does along the row.
TEST_P(SetCubic, AgreesWithSettingEachVoxelInANarrowRange) {
  const std::array<double, 4> c = {0, 1, 0.5, -0.25};
  const bool integer = GetParam() != SampleType::kFloat32;
  const PlaneSpec spec = channel_plane(GetParam(), integer ? std::optional(ValueRange{1.25, 1.250002}) : std::nullopt);
  ContonePlane row(spec, {"a", -1, 2}, 1), each(spec, {"a", -1, 2}, 1);
  row.clear(200, 1);
  each.clear(200, 1);
  constexpr double kFirst = 1, kStep = 8e-9;
  row.set_cubic(0, 0, 200, kFirst, kStep, c);
  for (std::uint32_t k = 0; k < 200; ++k) {
    const double t = kFirst + kStep * k;
    each.set(k, std::vector<double>{99, ((c[3] * t + c[2]) * t + c[1]) * t + c[0]});
  }
  for (std::size_t x = 0; x < 200; ++x) ASSERT_NEAR(sample(row, x), sample(each, x), step()) << x;
}

TEST_P(SetCubic, ClampsToTheChannelsRange) {
  ContonePlane plane(channel_plane(GetParam()), {"a", -1, 2}, 1);
  plane.clear(3, 1);
  plane.set_cubic(0, 0, 3, -1, 1, {0.5, 100, 0, 0});
  const double largest = GetParam() == SampleType::kUint8 ? 255 : 65535;
  const bool integer = GetParam() != SampleType::kFloat32;
  EXPECT_EQ(sample(plane, 0), integer ? 0 : -1);
  EXPECT_EQ(sample(plane, 1), integer ? largest / 2 + 0.5 : 0.5);
  EXPECT_EQ(sample(plane, 2), integer ? largest : 2);
}

TEST_P(SetCubic, OfAConstantChannelIsThatOfSet) {
  ContonePlane row(channel_plane(GetParam()), {"a", 4, 4}, 1), each(channel_plane(GetParam()), {"a", 4, 4}, 1);
  row.clear(70, 1);
  each.clear(70, 1);
  row.set_cubic(0, 0, 70, -1, 0.03, {4 + 1e-12, 1e-13, 0, 0});
  for (std::size_t x = 0; x < 70; ++x) each.set(x, std::vector<double>{99, 4});
  for (std::size_t x = 0; x < 70; ++x) ASSERT_EQ(sample(row, x), sample(each, x));
}

INSTANTIATE_TEST_SUITE_P(AllTypes, SetCubic,
                         testing::Values(SampleType::kUint8, SampleType::kUint16, SampleType::kFloat32),
                         [](const testing::TestParamInfo<SampleType>& info) {
                           return info.param == SampleType::kUint8    ? "Uint8"
                                  : info.param == SampleType::kUint16 ? "Uint16"
                                                                      : "Float32";
                         });

// Within a plane's range that the channel's doesn't reach, integer samples stop where the channel does.
TEST(SetCubicOfAWideRange, StopsWhereTheChannelDoes) {
  ContonePlane plane(channel_plane(SampleType::kUint8, ValueRange{0, 255}), {"a", 10, 20}, 1);
  plane.clear(2, 1);
  plane.set_cubic(0, 0, 2, -1, 2, {15, 50, 0, 0});
  EXPECT_THAT(plane.image().samples, ElementsAre(10, 20));
}

TEST(ContonePlane, ACubicIsTheSameFromAnywhereOn) {
  for (const SampleType type : {SampleType::kUint8, SampleType::kUint16, SampleType::kFloat32}) {
    PlaneSpec spec;
    spec.content = PlaneContent::kChannel;
    spec.sample_type = type;
    ContonePlane whole(spec, {"", 0, 1}, 0), part(spec, {"", 0, 1}, 0);
    const std::array<double, 4> c = {0.4, 0.3, -0.2, 0.37};
    whole.clear(200, 1);
    whole.set_cubic(0, 0, 200, -1, 0.0101, c);
    for (std::uint32_t first = 1; first < 200; ++first) {
      part.clear(200, 1);
      part.set_cubic(0, 0, first, -1, 0.0101, c);
      part.set_cubic(first, first, 200 - first, -1, 0.0101, c);
      EXPECT_TRUE(std::ranges::equal(whole.image().samples, part.image().samples)) << first;
    }
  }
}

}  // namespace
}  // namespace ccslice
