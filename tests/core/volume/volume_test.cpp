// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume/volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/volume/load_sample.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

template <typename Sample>
std::vector<std::byte> bytes_of_samples(const std::vector<Sample>& samples) {
  std::vector<std::byte> bytes(samples.size() * sizeof(Sample));
  std::memcpy(bytes.data(), samples.data(), bytes.size());
  return bytes;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Volume, CountsWhatItHolds) {
  const Volume volume({.samples = {2, 1, 2}, .channels = 2, .type = VolumeSampleType::kInt16},
                      bytes_of_samples<std::int16_t>({1, -7, 2, -8, 3, -9, 4, 100}));
  ASSERT_EQ(volume.channels().size(), 2u);
  EXPECT_EQ(volume.channels()[0].min, 1);
  EXPECT_EQ(volume.channels()[0].max, 4);
  EXPECT_EQ(volume.channels()[1].min, -9);
  EXPECT_EQ(volume.channels()[1].max, 100);
  EXPECT_EQ(volume.channels()[1].nan, 0u);
  EXPECT_EQ(load_sample<std::int16_t>(volume.bytes(), 3), -8);
  EXPECT_LT(volume.memory_bytes(), 16 + 256);
}

TEST(Volume, LeavesNanAside) {
  const Volume volume({.samples = {4, 1, 1}, .type = VolumeSampleType::kFloat32},
                      bytes_of_samples<float>({kNan, 2, kNan, -1}));
  EXPECT_EQ(volume.channels()[0].min, -1);
  EXPECT_EQ(volume.channels()[0].max, 2);
  EXPECT_EQ(volume.channels()[0].nan, 2u);
  const Volume none({.samples = {1, 1, 2}, .type = VolumeSampleType::kFloat32}, bytes_of_samples<float>({kNan, kNan}));
  EXPECT_EQ(none.channels()[0].min, 0);
  EXPECT_EQ(none.channels()[0].max, 0);
  EXPECT_EQ(none.channels()[0].nan, 2u);
}

TEST(Volume, RefusesWhatIsNone) {
  const auto make = [](VolumeShape shape, std::size_t bytes) {
    return [shape, bytes] { (void)Volume(shape, std::vector<std::byte>(bytes)); };
  };
  expect_error(make({.samples = {0, 1, 1}}, 0), ErrorCode::kVolumeInvalid, "samples_i");
  expect_error(make({.samples = {1, 1, 0}}, 0), ErrorCode::kVolumeInvalid, "samples_k");
  expect_error(make({.samples = {1, 1, 1}, .channels = 0}, 0), ErrorCode::kVolumeInvalid, "channels");
  expect_error(make({.samples = {1, 1, 1}, .channels = 257}, 0), ErrorCode::kVolumeInvalid, "channels");
  expect_error(make({.samples = {2, 2, 2}}, 7), ErrorCode::kVolumeInvalid, "7 bytes of samples, and the volume has 8");
  expect_error(make({.samples = {~0u, ~0u, ~0u}}, 7), ErrorCode::kVolumeInvalid, "too many");
  const float infinity = std::numeric_limits<float>::infinity();
  expect_error(
      [&] {
        (void)Volume({.samples = {2, 2, 2}, .type = VolumeSampleType::kFloat32},
                     bytes_of_samples<float>({0, 1, 2, 3, 4, 5, infinity, 7}));
      },
      ErrorCode::kVolumeInvalid, "(i, j, k) = (0, 1, 1) is infinite");
}

TEST(Volume, CanBeCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  expect_error(
      [&] {
        (void)Volume({.samples = {1, 1, 1}}, std::vector<std::byte>(1), cancel);
      },
      ErrorCode::kCancelled, "");
}

TEST(Volume, NamesItsTypes) {
  EXPECT_EQ(name_of(VolumeSampleType::kUint8), "UINT8");
  EXPECT_EQ(name_of(VolumeSampleType::kInt16), "INT16");
  EXPECT_EQ(name_of(VolumeSampleType::kUint16), "UINT16");
  EXPECT_EQ(name_of(VolumeSampleType::kFloat32), "FLOAT32");
  EXPECT_EQ(bytes_of(VolumeSampleType::kInt16), 2u);
}

}  // namespace
}  // namespace ccslice
