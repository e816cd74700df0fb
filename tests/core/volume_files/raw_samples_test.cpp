// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/raw_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"

namespace ccslice {
namespace {

using Kind = RawFormat::Kind;
using testing::ElementsAre;

VolumeFile taken(const VolumeShape& shape, const std::string& bytes, RawFormat format, RawOrder order = {}) {
  VolumeFile file;
  file.shape = shape;
  EXPECT_EQ(raw_bytes(shape, format), bytes.size());
  take_samples(bytes, format, order, file);
  EXPECT_EQ(file.samples.size(), file.shape.bytes());
  return file;
}

template <typename Number>
void expect_kept(const std::vector<Number>& numbers, Kind kind, VolumeSampleType type, bool rounds = false) {
  for (const bool big_endian : {false, true}) {
    const VolumeFile file =
        taken({.samples = {static_cast<std::uint32_t>(numbers.size()), 1, 1}}, raw(numbers, big_endian),
              {.kind = kind, .bytes = sizeof(Number), .big_endian = big_endian});
    EXPECT_EQ(file.shape.type, type);
    EXPECT_EQ(file.notes.empty(), !rounds);
    const std::vector<double> found = numbers_of(file);
    for (std::size_t s = 0; s < numbers.size(); ++s) {
      EXPECT_EQ(found[s],
                rounds ? static_cast<double>(static_cast<float>(numbers[s])) : static_cast<double>(numbers[s]));
    }
  }
}

TEST(RawSamples, KeepNumbersOfEachKind) {
  expect_kept<std::uint8_t>({0, 255}, Kind::kUnsigned, VolumeSampleType::kUint8);
  expect_kept<std::int8_t>({-128, 127}, Kind::kSigned, VolumeSampleType::kInt16);
  expect_kept<std::int16_t>({-32768, 32767}, Kind::kSigned, VolumeSampleType::kInt16);
  expect_kept<std::uint16_t>({0, 65535}, Kind::kUnsigned, VolumeSampleType::kUint16);
  expect_kept<float>({-1.5f, 3e38f}, Kind::kFloat, VolumeSampleType::kFloat32);
  expect_kept<std::int32_t>({0, 255}, Kind::kSigned, VolumeSampleType::kUint8);
  expect_kept<std::int32_t>({-1, 255}, Kind::kSigned, VolumeSampleType::kInt16);
  expect_kept<std::uint32_t>({0, 65535}, Kind::kUnsigned, VolumeSampleType::kUint16);
  expect_kept<std::int64_t>({-70'000, 1 << 24}, Kind::kSigned, VolumeSampleType::kFloat32);
  expect_kept<std::int64_t>({0, (1 << 24) + 1}, Kind::kSigned, VolumeSampleType::kFloat32, true);
  expect_kept<std::uint64_t>({0, (1 << 30) + 1}, Kind::kUnsigned, VolumeSampleType::kFloat32, true);
  expect_kept<double>({0, 100}, Kind::kFloat, VolumeSampleType::kUint8);
  expect_kept<double>({0.5, -1}, Kind::kFloat, VolumeSampleType::kFloat32);
  expect_kept<double>({0.1}, Kind::kFloat, VolumeSampleType::kFloat32, true);
}

TEST(RawSamples, KeepNan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const VolumeFile file = taken({.samples = {2, 1, 1}}, raw<double>({1, nan}), {.kind = Kind::kFloat, .bytes = 8});
  EXPECT_EQ(file.shape.type, VolumeSampleType::kFloat32);
  EXPECT_TRUE(std::isnan(numbers_of(file)[1]));
}

TEST(RawSamples, AreBroughtIntoOrder) {
  const VolumeShape shape{.samples = {2, 1, 3}, .channels = 2};
  const std::string bytes = raw<std::uint8_t>({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  EXPECT_THAT(numbers_of(taken(shape, bytes, {})), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_THAT(numbers_of(taken(shape, bytes, {}, {.channels_last = true})),
              ElementsAre(0, 6, 1, 7, 2, 8, 3, 9, 4, 10, 5, 11));
  EXPECT_THAT(numbers_of(taken(shape, bytes, {}, {.k_fastest = true})),
              ElementsAre(0, 1, 6, 7, 2, 3, 8, 9, 4, 5, 10, 11));
  EXPECT_THAT(numbers_of(taken(shape, bytes, {}, {.channels_last = true, .k_fastest = true})),
              ElementsAre(0, 6, 3, 9, 1, 7, 4, 10, 2, 8, 5, 11));
}

TEST(RawSamples, TakeNumbersOfText) {
  VolumeFile file;
  file.shape.samples = {3, 1, 1};
  take_text("1 -2 300", {}, file);
  EXPECT_EQ(file.shape.type, VolumeSampleType::kInt16);
  EXPECT_THAT(numbers_of(file), ElementsAre(1, -2, 300));
}

TEST(RawSamples, HaveABound) {
  expect_error([] { (void)raw_bytes({.samples = {1 << 16, 1 << 16, 256}}, {}); }, ErrorCode::kMeshTooLarge, "8 GiB");
  expect_error([] { (void)raw_bytes({.samples = {1, 0, 1}}, {}); }, ErrorCode::kVolumeInvalid, "samples_j");
}

}  // namespace
}  // namespace ccslice
