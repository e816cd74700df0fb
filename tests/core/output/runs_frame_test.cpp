// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/runs_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/output/encode.h"
#include "tests/core/output/tiny_runs.h"

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr SampleType kRunTypes[] = {SampleType::kBit,   SampleType::kUint2,  SampleType::kUint4,
                                    SampleType::kUint8, SampleType::kUint16, SampleType::kFloat32};

/// A picture whose voxels inside are random, and its samples.
struct Drawn {
  std::uint32_t columns, rows, channels;
  SampleType type;
  std::vector<VoxelRun> spans;
  std::vector<std::string> names;
  Bytes inside, samples;
  std::array<std::uint8_t, 4> outside{};

  SampleImage image() const {
    SampleImage image{type, columns, rows, samples, names};
    image.spans = spans;
    image.outside = outside;
    return image;
  }
};

std::uint32_t bits_of(SampleType type) { return static_cast<std::uint32_t>(sample_bytes(type, 8, 1)); }

/// `steep`: how far a value is from its neighbours, from 0 to 1.
Drawn draw(std::mt19937& random, SampleType type, double steep) {
  const auto up_to = [&](std::uint32_t most) { return static_cast<std::uint32_t>(random() % (most + 1)); };
  Drawn drawn{1 + up_to(90), 1 + up_to(40), 1, type, {}, {}, {}, {}, {}};
  if (type == SampleType::kFloat32) drawn.channels = 1 + up_to(2);
  for (std::uint32_t c = 0; drawn.channels > 1 && c < drawn.channels; ++c) drawn.names.push_back(std::to_string(c));
  const std::uint32_t bits = bits_of(type), most_gap = 1 + up_to(60), most_length = 1 + up_to(60);
  drawn.inside.resize(std::size_t{drawn.columns} * drawn.rows);
  for (std::uint32_t row = 0; row < drawn.rows; ++row) {
    if (up_to(5) == 0) continue;
    for (std::uint32_t x = up_to(most_gap); x < drawn.columns; x += 1 + up_to(most_gap)) {
      const std::uint32_t end = std::min(drawn.columns, x + 1 + up_to(most_length));
      drawn.spans.push_back({row, x, end});
      for (; x < end; ++x) drawn.inside[std::size_t{drawn.columns} * row + x] = 1;
    }
  }
  if (bits >= 8 && up_to(1) == 0) {
    for (std::size_t byte = 0; byte < bits / 8; ++byte) drawn.outside[byte] = static_cast<std::uint8_t>(random());
  }
  drawn.samples.assign(sample_bytes(type, drawn.columns, drawn.rows, drawn.channels), 0);
  const std::size_t row_bytes = drawn.samples.size() / drawn.rows;
  std::uniform_real_distribution<double> noise(-steep, steep);
  for (std::uint32_t row = 0; row < drawn.rows; ++row) {
    for (std::uint32_t x = 0; x < drawn.columns; ++x) {
      for (std::uint32_t c = 0; c < drawn.channels; ++c) {
        const double value = std::clamp(0.3 + 0.004 * x + 0.007 * row - 0.1 * c + noise(random), 0.0, 1.0);
        const bool inside = drawn.inside[std::size_t{drawn.columns} * row + x];
        std::uint8_t* out = &drawn.samples[row_bytes * row];
        if (bits < 8) {
          const auto number = static_cast<std::uint32_t>(value * ((1u << bits) - 1) + 0.5);
          const std::uint32_t bit = bits * x;
          if (inside) out[bit / 8] |= static_cast<std::uint8_t>(number << (8 - bits - bit % 8));
        } else {
          const auto number = static_cast<std::uint32_t>(value * (bits == 8 ? 255 : 65535));
          const auto real = static_cast<float>(value);
          const void* sample = type == SampleType::kFloat32 ? static_cast<const void*>(&real) : &number;
          std::memcpy(out + bits / 8 * (drawn.channels * x + c), inside ? sample : drawn.outside.data(), bits / 8);
        }
      }
    }
  }
  return drawn;
}

Bytes frame_of(const SampleImage& image, RunsCoding coding) {
  RunsEncoder encoder;
  ZstdEncoder zstd;
  return encoder.frame(image, coding, zstd, {});
}

TinyRuns read(const Drawn& drawn, const Bytes& frame) {
  return read_tiny_runs(frame, drawn.type, drawn.columns, drawn.rows, drawn.channels);
}

TEST(RunsFrame, HoldsAllSamplesOfEveryType) {
  std::mt19937 random(59);
  for (int turn = 0; turn < 600; ++turn) {
    const SampleType type = kRunTypes[turn % std::size(kRunTypes)];
    const Drawn drawn = draw(random, type, turn % 4 == 0 ? 1 : 0.004 * (turn % 7));
    const TinyRuns got = read(drawn, frame_of(drawn.image(), coding_of(type)));
    ASSERT_EQ(got.inside, drawn.inside) << turn;
    ASSERT_EQ(got.samples, drawn.samples) << turn;
    ASSERT_EQ(got.coding, static_cast<int>(coding_of(type))) << turn;
  }
}

TEST(RunsFrame, PacksNumbersOfEightBitsAsTheyAre) {
  std::mt19937 random(60);
  const Drawn drawn = draw(random, SampleType::kUint8, 1);
  const TinyRuns got = read(drawn, frame_of(drawn.image(), RunsCoding::kPacked));
  EXPECT_EQ(got.coding, 1);
  EXPECT_EQ(got.samples, drawn.samples);
}

TEST(RunsFrame, NeedsNothingForOccupanciesButTheirSpans) {
  Drawn drawn{10, 2, 1, SampleType::kBit, {{0, 1, 9}, {1, 0, 1}}, {}, {}, {0b01111111, 0b10000000, 0b10000000, 0}, {}};
  const TinyRuns got = read(drawn, frame_of(drawn.image(), RunsCoding::kConstant));
  EXPECT_EQ(got.coding, 0);
  EXPECT_EQ(got.samples, drawn.samples);
}

TEST(RunsFrame, IsTheSameWhateverWasEncodedBefore) {
  std::mt19937 random(61);
  RunsEncoder encoder;
  ZstdEncoder zstd;
  for (int turn = 0; turn < 60; ++turn) {
    const SampleType type = kRunTypes[turn % std::size(kRunTypes)];
    const Drawn drawn = draw(random, type, 0.1);
    EXPECT_EQ(encoder.frame(drawn.image(), coding_of(type), zstd, {}), frame_of(drawn.image(), coding_of(type)));
  }
}

TEST(RunsFrame, TakesAnEighthOfTheBytesOfSamplesThatChangeSlowly) {
  Drawn drawn{1000, 500, 1, SampleType::kUint8, {}, {}, {}, Bytes(500000), {}};
  for (std::uint32_t row = 0; row < drawn.rows; ++row) {
    const std::uint32_t begin = row < 250 ? 250 - row : row - 250;
    drawn.spans.push_back({row, begin, 1000 - begin});
    for (std::uint32_t x = begin; x < 1000 - begin; ++x) {
      drawn.samples[1000 * row + x] = static_cast<std::uint8_t>(x / 10 + row / 5);
    }
  }
  ZstdEncoder zstd;
  const std::size_t raw = zstd.frame(drawn.samples, {}).size();
  EXPECT_LT(8 * frame_of(drawn.image(), RunsCoding::kDifferences).size(), raw);
}

TEST(RunsFrame, StopsWhenCancelled) {
  std::mt19937 random(62);
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const Drawn drawn = draw(random, SampleType::kUint8, 0.1);
  RunsEncoder encoder;
  ZstdEncoder zstd;
  EXPECT_THROW((void)encoder.frame(drawn.image(), RunsCoding::kDifferences, zstd, cancel), Error);
}

}  // namespace
}  // namespace ccslice
