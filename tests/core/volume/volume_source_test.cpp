// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

//
// The oracle weighs all samples of a volume by tents, in long double, without looking for those around a point.

#include "core/volume/volume_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <vector>

namespace ccslice {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Samples, as numbers and as the volume's bytes.
struct RandomVolume {
  VolumeShape shape;
  std::vector<double> numbers;
  std::shared_ptr<const Volume> volume;

  double number(std::uint32_t i, std::uint32_t j, std::uint32_t k, std::uint32_t channel) const {
    const auto [ni, nj, nk] = shape.samples;
    return numbers[((std::size_t{k} * nj + j) * ni + i) * shape.channels + channel];
  }
};

template <typename Sample>
void add_sample(double number, std::vector<std::byte>& bytes) {
  const auto sample = static_cast<Sample>(number);
  const auto* begin = reinterpret_cast<const std::byte*>(&sample);
  bytes.insert(bytes.end(), begin, begin + sizeof(Sample));
}

RandomVolume random_volume(Random& random, double nan_share = 0) {
  RandomVolume made;
  for (std::uint32_t& count : made.shape.samples) count = 1 + static_cast<std::uint32_t>(random() % 6);
  made.shape.channels = 1 + static_cast<std::uint32_t>(random() % 3);
  made.shape.type = nan_share > 0 ? VolumeSampleType::kFloat32 : static_cast<VolumeSampleType>(random() % 4);
  std::vector<std::byte> bytes;
  const std::size_t count = made.shape.bytes() / bytes_of(made.shape.type);
  for (std::size_t s = 0; s < count; ++s) {
    switch (made.shape.type) {
      case VolumeSampleType::kUint8:
        made.numbers.push_back(static_cast<double>(random() % 256));
        add_sample<std::uint8_t>(made.numbers.back(), bytes);
        break;
      case VolumeSampleType::kInt16:
        made.numbers.push_back(static_cast<double>(random() % 65536) - 32768);
        add_sample<std::int16_t>(made.numbers.back(), bytes);
        break;
      case VolumeSampleType::kUint16:
        made.numbers.push_back(static_cast<double>(random() % 65536));
        add_sample<std::uint16_t>(made.numbers.back(), bytes);
        break;
      case VolumeSampleType::kFloat32:
        made.numbers.push_back(static_cast<float>(uniform(random, -100, 1000)));
        if (uniform(random, 0, 1) < nan_share) made.numbers.back() = std::numeric_limits<double>::quiet_NaN();
        add_sample<float>(made.numbers.back(), bytes);
        break;
    }
  }
  made.volume = std::make_shared<const Volume>(made.shape, bytes);
  return made;
}

Mat3 random_matrix(Random& random) {
  Mat3 matrix;
  do {
    for (int i = 0; i < 9; ++i) matrix(i) = uniform(random, -2, 2);
  } while (std::abs(matrix.determinant()) < 0.3);
  return matrix;
}

/// NaN: outside.
long double oracle(const RandomVolume& volume, const VolumeReading& reading, const Vec3& point) {
  const Vec3 at = reading.index_of_mm * point + reading.first_index;
  const auto& n = volume.shape.samples;
  long double x[3];
  for (int axis = 0; axis < 3; ++axis) {
    const long double last = n[static_cast<std::size_t>(axis)] - 1;
    if (at[axis] < -0.5 || at[axis] > last + 0.5) return std::numeric_limits<long double>::quiet_NaN();
    x[axis] = std::clamp<long double>(at[axis], 0, last);
  }
  const auto tent = [](long double distance) { return std::max(0.0L, 1 - std::abs(distance)); };
  const auto nearest = [](long double at_axis, std::uint32_t index) {
    return std::floor(at_axis + 0.5L) == index ? 1.0L : 0.0L;
  };
  long double sum = 0;
  for (std::uint32_t k = 0; k < n[2]; ++k) {
    for (std::uint32_t j = 0; j < n[1]; ++j) {
      for (std::uint32_t i = 0; i < n[0]; ++i) {
        const long double weight = reading.nearest ? nearest(x[0], i) * nearest(x[1], j) * nearest(x[2], k)
                                                   : tent(x[0] - i) * tent(x[1] - j) * tent(x[2] - k);
        if (weight != 0) sum += weight * volume.number(i, j, k, reading.channel);
      }
    }
  }
  return reading.slope * sum + reading.intercept;
}

VolumeReading random_reading(Random& random, const RandomVolume& volume) {
  VolumeReading reading;
  reading.channel = static_cast<std::uint32_t>(random() % volume.shape.channels);
  reading.index_of_mm = random_matrix(random);
  for (int axis = 0; axis < 3; ++axis) reading.first_index[axis] = uniform(random, -1, 5);
  reading.nearest = random() % 3 == 0;
  reading.slope = random() % 2 == 0 ? 1 : uniform(random, -3, 3);
  reading.intercept = random() % 2 == 0 ? 0 : uniform(random, -50, 50);
  reading.outside_value = -12345;
  return reading;
}

constexpr double kFar = 1e9;

std::vector<float> sampled(const VolumeSource& source, const SourceRow& row) {
  std::vector<float> values(row.count);
  source.sample_row(row, {}, values);
  return values;
}

TEST(VolumeSource, IsTheSumOfAllSamplesByTheirWeights) {
  Random random(1);
  int inside = 0, outside = 0;
  for (int turn = 0; turn < 2000; ++turn) {
    const RandomVolume volume = random_volume(random, turn % 4 == 0 ? 0.2 : 0);
    VolumeReading reading = random_reading(random, volume);
    reading.in_world = turn % 2 == 0;
    const VolumeSource source({"v", -kFar, kFar}, volume.volume, reading);
    const auto index = [&](std::size_t axis) { return uniform(random, -0.7, volume.shape.samples[axis] - 0.3); };
    const Mat3 mm_of_index = reading.index_of_mm.inverse();
    const Vec3 first = mm_of_index * (Vec3(index(0), index(1), index(2)) - reading.first_index);
    const Vec3 step(uniform(random, -.02, .02), uniform(random, -.02, .02), uniform(random, -.02, .02));
    const Vec3 other(1e6, 1e6, 1e6);
    SourceRow row{first, step, other, step, 0, 100};
    if (!reading.in_world) row = {other, step, first, step, 0, 100};
    const std::vector<float> values = sampled(source, row);
    for (std::uint32_t k = 0; k < row.count; ++k) {
      const Vec3 point = first + static_cast<double>(k) * step;
      // A point on the side of a cell may fall on either side of it by rounding.
      const Vec3 at = reading.index_of_mm * point + reading.first_index;
      const Vec3 halves = (2 * at).array().round() - 2 * at.array();
      if (halves.cwiseAbs().minCoeff() < 3e-6) continue;
      const long double expected = oracle(volume, reading, point);
      if (std::isnan(expected)) {
        EXPECT_EQ(values[k], -12345.0f) << turn << " " << k;
        EXPECT_TRUE(source.is_outside(reading.in_world ? point : other, reading.in_world ? other : point));
        ++outside;
      } else {
        EXPECT_NEAR(values[k], static_cast<double>(expected), 0.02 + 1e-6 * std::abs(static_cast<double>(expected)))
            << turn << " " << k;
        ++inside;
      }
    }
  }
  EXPECT_GT(inside, 20000);
  EXPECT_GT(outside, 20000);
}

TEST(VolumeSource, HasTheSameBitsWhereverARowBegins) {
  Random random(2);
  for (int turn = 0; turn < 50; ++turn) {
    const RandomVolume volume = random_volume(random, turn % 2 == 0 ? 0.2 : 0);
    const VolumeSource source({"v", -kFar, kFar}, volume.volume, random_reading(random, volume));
    SourceRow row{Vec3::Zero(), Vec3::Zero(), Vec3(-1, 0.1, 0.2), Vec3(0.013, 0.007, -0.003), 0, 300};
    const std::vector<float> all = sampled(source, row);
    for (const auto& [begin, count] : {std::pair{1u, 299u}, {63u, 2u}, {64u, 64u}, {299u, 1u}}) {
      row.begin = begin;
      row.count = count;
      const std::vector<float> part = sampled(source, row);
      EXPECT_EQ(std::memcmp(part.data(), all.data() + begin, count * sizeof(float)), 0) << turn << " " << begin;
    }
  }
}

std::shared_ptr<const Volume> ramp() {
  std::vector<std::byte> bytes;
  for (int i = 0; i < 4; ++i) bytes.push_back(std::byte(10 * i));
  return std::make_shared<const Volume>(VolumeShape{.samples = {4, 1, 1}}, bytes);
}

float at(const VolumeSource& source, double x) {
  return sampled(source, {Vec3::Zero(), Vec3::Zero(), Vec3(x, 0, 0), Vec3::Zero(), 0, 1}).front();
}

TEST(VolumeSource, ReachesHalfAStepBeyondItsOuterSamples) {
  const VolumeSource source({"v", -100, 100}, ramp(), {.outside_value = -5});
  EXPECT_EQ(at(source, -0.51), -5);
  EXPECT_EQ(at(source, -0.5), 0);
  EXPECT_EQ(at(source, 0), 0);
  EXPECT_EQ(at(source, 0.25), 2.5f);
  EXPECT_EQ(at(source, 3), 30);
  EXPECT_EQ(at(source, 3.5), 30);
  EXPECT_EQ(at(source, 3.51), -5);
  EXPECT_EQ(at(source, 1e300), -5);
  EXPECT_EQ(at(source, std::numeric_limits<double>::infinity()), -5);
}

TEST(VolumeSource, TakesTheNearestSample) {
  const VolumeSource source({"v", -100, 100}, ramp(), {.nearest = true, .outside_value = -5});
  EXPECT_EQ(at(source, 0.49), 0);
  EXPECT_EQ(at(source, 0.51), 10);
  EXPECT_EQ(at(source, 3.5), 30);
  EXPECT_EQ(at(source, -0.5), 0);
  EXPECT_EQ(at(source, -0.6), -5);
}

TEST(VolumeSource, ClampsToItsRange) {
  const VolumeSource source({"v", 5, 15}, ramp(), {.outside_value = -5});
  EXPECT_EQ(at(source, 0), 5);
  EXPECT_EQ(at(source, 1), 10);
  EXPECT_EQ(at(source, 3), 15);
  EXPECT_EQ(at(source, 9), 5);
}

TEST(VolumeSource, IgnoresNanThatDoesNotCount) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<std::byte> bytes;
  for (const float sample : {1.0f, nan, 3.0f, 4.0f}) add_sample<float>(sample, bytes);
  const VolumeShape shape{.samples = {4, 1, 1}, .type = VolumeSampleType::kFloat32};
  const VolumeSource source({"v", -100, 100}, std::make_shared<const Volume>(shape, bytes), {.outside_value = -5});
  EXPECT_EQ(at(source, 0), 1);
  EXPECT_EQ(at(source, 0.001), -5);
  EXPECT_EQ(at(source, 1), -5);
  EXPECT_EQ(at(source, 1.999), -5);
  EXPECT_EQ(at(source, 2), 3);
  EXPECT_EQ(at(source, 2.5), 3.5f);
}

TEST(VolumeSource, BoundsItsValuesInABox) {
  const auto volume = ramp();
  const VolumeReading reading{.slope = -2, .intercept = 1, .outside_value = 500};
  const Box3 within(Vec3(0, -0.4, -0.4), Vec3(3, 0.4, 0.4)), beyond(Vec3(0, -0.4, -0.4), Vec3(3, 0.4, 0.6));
  EXPECT_EQ(value_bounds(*volume, reading, within), (std::array<double, 2>{-59, 1}));
  EXPECT_EQ(value_bounds(*volume, reading, beyond), (std::array<double, 2>{-59, 500}));
}

TEST(VolumeSource, SaysWhereItsSamplesLie) {
  VolumeReading reading;
  reading.index_of_mm = Vec3(2, 4, 1).asDiagonal();  // Steps of 0.5, 0.25 and 1 mm.
  reading.first_index = Vec3(-2, 0, 0);
  const VolumeSource source({"v", 0, 1}, ramp(), reading);
  EXPECT_TRUE(source.box().min().isApprox(Vec3(0.75, -0.125, -0.5)));
  EXPECT_TRUE(source.box().max().isApprox(Vec3(2.75, 0.125, 0.5)));
  EXPECT_TRUE(source.follows_part());
  reading.in_world = true;
  EXPECT_FALSE(VolumeSource({"v", 0, 1}, ramp(), reading).follows_part());
}

}  // namespace
}  // namespace ccslice
