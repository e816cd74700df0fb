// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/runs_frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "client/client_error.h"
#include "client/layer.h"
#include "core/output/encode.h"
#include "core/output/runs_frame.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;

v1::GridExtent picture_of(std::uint32_t columns, std::uint32_t rows) {
  v1::GridExtent extent;
  extent.set_columns(columns);
  extent.set_rows(rows);
  return extent;
}

v1::PlaneSpec samples_of(v1::SampleType type, int channels = 1) {
  v1::PlaneSpec spec;
  spec.set_sample_type(type);
  for (int c = 0; channels > 1 && c < channels; ++c) spec.mutable_channels()->add_names(std::to_string(c));
  return spec;
}

std::string content_of(std::initializer_list<int> values) {
  std::string text;
  for (const int value : values) text.push_back(static_cast<char>(value));
  return text;
}

/// Of 4 columns and 2 rows.
std::string expand_content(v1::SampleType type, const std::string& content, std::uint64_t size) {
  return expand_runs(samples_of(type), picture_of(4, 2), content, size);
}

std::string failure_of_runs(v1::SampleType type, const std::string& content, std::uint64_t size = 8) {
  try {
    expand_content(type, content, size);
  } catch (const ClientError& error) {
    EXPECT_EQ(error.reason(), local_reason::kAnswerCorrupt);
    return error.what();
  }
  return "nothing is wrong";
}

TEST(RunsFrame, AreReadAsTheirPageSays) {
  // Spans: columns 1 to 2, then 0 and 2 to 3.
  const std::string spans = content_of({1, 2, 4, 2, 1, 3, 2, 4});
  EXPECT_EQ(expand_content(v1::SAMPLE_TYPE_BIT, content_of({0, 0}) + spans + content_of({1}), 2),
            content_of({0b01100000, 0b10110000}));
  EXPECT_EQ(expand_content(v1::SAMPLE_TYPE_UINT2, content_of({1, 0}) + spans + content_of({0b01101100, 0b11000000}), 2),
            content_of({0b00011000, 0b11000011}));
  EXPECT_EQ(expand_content(v1::SAMPLE_TYPE_UINT8, content_of({1, 9}) + spans + content_of({1, 2, 3, 4, 5}), 8),
            content_of({9, 1, 2, 9, 3, 9, 4, 5}));
  // Differences: 7 from 0, -1 from the left, 1 from the next above, 2 from above, -2 from the left.
  EXPECT_EQ(expand_content(v1::SAMPLE_TYPE_UINT8, content_of({2, 9}) + spans + content_of({4, 0xe1, 0x24, 0x30}), 8),
            content_of({9, 7, 6, 9, 8, 9, 8, 6}));
}

TEST(RunsFrame, TellWhatIsWrongWithThem) {
  constexpr auto kType = v1::SAMPLE_TYPE_UINT8;
  EXPECT_THAT(failure_of_runs(kType, ""), HasSubstr("it ends early"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 0})), HasSubstr("it ends early"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 1, 0, 10})), HasSubstr("a span beyond its row"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 1, 10, 2})), HasSubstr("a span beyond its row"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 1, 0, 0})),
              HasSubstr("a span that is empty or not to the right"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 2, 0, 2, 0, 2})),
              HasSubstr("a span that is empty or not to the right"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 1, 0, 0xff, 0xff, 0xff, 0xff, 0x7f})),
              HasSubstr("more than 32 bits"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 1, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0})),
              HasSubstr("more than 32 bits"));
  EXPECT_THAT(failure_of_runs(kType, content_of({4, 0, 0, 0})), HasSubstr("a coding of number 4"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 0, 0, 7})), HasSubstr("it goes on after its samples"));
  EXPECT_THAT(failure_of_runs(kType, content_of({1, 0, 0, 1, 0, 4, 7})), HasSubstr("it ends early"));
  EXPECT_THAT(failure_of_runs(kType, content_of({2, 0, 0, 1, 0, 2, 3, 0})), HasSubstr("a block of 3 bits"));
  EXPECT_THAT(failure_of_runs(kType, content_of({2, 0, 0, 1, 0, 2, 16, 0, 0})), HasSubstr("a block of 16 bits"));
  EXPECT_THAT(failure_of_runs(kType, content_of({2, 0, 0, 1, 0, 2, 17, 0, 0, 0})), HasSubstr("a block of 17 bits"));
  EXPECT_THAT(failure_of_runs(kType, content_of({3, 0, 0, 0})), HasSubstr("byte planes of samples that aren't floats"));
  EXPECT_THAT(failure_of_runs(v1::SAMPLE_TYPE_BIT, content_of({2, 0, 0, 0}), 2), HasSubstr("differences of samples"));
  EXPECT_THAT(failure_of_runs(v1::SAMPLE_TYPE_BIT, content_of({0, 1, 0, 0, 1}), 2), HasSubstr("aren't 0 outside"));
  EXPECT_THAT(failure_of_runs(v1::SAMPLE_TYPE_BIT, content_of({0, 0, 0, 0, 2}), 2),
              HasSubstr("more bits than its type"));
}

/// What the server's encoder makes of a random picture.
struct DrawnRuns {
  v1::PlaneSpec spec;
  v1::GridExtent extent;
  std::string samples, content;
};

DrawnRuns draw_runs(std::mt19937& random) {
  const auto up_to = [&](std::uint32_t most) { return static_cast<std::uint32_t>(random() % (most + 1)); };
  constexpr std::pair<SampleType, v1::SampleType> kDrawnTypes[] = {
      {SampleType::kBit, v1::SAMPLE_TYPE_BIT},       {SampleType::kUint2, v1::SAMPLE_TYPE_UINT2},
      {SampleType::kUint4, v1::SAMPLE_TYPE_UINT4},   {SampleType::kUint8, v1::SAMPLE_TYPE_UINT8},
      {SampleType::kUint16, v1::SAMPLE_TYPE_UINT16}, {SampleType::kFloat32, v1::SAMPLE_TYPE_FLOAT32}};
  const auto [type, contract_type] = kDrawnTypes[up_to(5)];
  const std::uint32_t columns = 1 + up_to(700), rows = 1 + up_to(20);
  const int channels = type == SampleType::kFloat32 ? 1 + static_cast<int>(up_to(2)) : 1;
  DrawnRuns drawn{samples_of(contract_type, channels), picture_of(columns, rows), {}, {}};
  std::vector<VoxelRun> spans;
  const std::uint32_t most_gap = 1 + up_to(300), most_length = 1 + up_to(600);
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t x = up_to(most_gap); x < columns;) {
      spans.push_back({row, x, std::min(columns, x + 1 + up_to(most_length))});
      x = spans.back().end + 1 + up_to(most_gap);
    }
  }
  drawn.samples.assign(sample_bytes(drawn.spec, drawn.extent), '\0');
  const std::size_t row_bytes = drawn.samples.size() / rows, bits = ccslice::sample_bytes(type, 8, 1);
  const std::uint32_t noise = 1u << up_to(16);
  for (const VoxelRun& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end; ++x) {
      for (int c = 0; c < channels; ++c) {
        const std::uint32_t value = 5 * x + 3 * span.row + up_to(noise);
        char* out = &drawn.samples[row_bytes * span.row];
        if (bits >= 8) {
          std::memcpy(out + bits / 8 * (x * static_cast<std::uint32_t>(channels) + static_cast<std::uint32_t>(c)),
                      &value, bits / 8);
        } else {
          out[bits * x / 8] |= static_cast<char>((value & ((1u << bits) - 1)) << (8 - bits - bits * x % 8));
        }
      }
    }
  }
  const std::vector<std::string> names(drawn.spec.channels().names().begin(), drawn.spec.channels().names().end());
  SampleImage image{
      type, columns, rows, {reinterpret_cast<const std::uint8_t*>(drawn.samples.data()), drawn.samples.size()}, names};
  image.spans = spans;
  const RunsCoding coding = type == SampleType::kUint8 && up_to(1) == 0 ? RunsCoding::kPacked : coding_of(type);
  RunsEncoder encoder;
  ZstdEncoder zstd;
  const std::vector<std::uint8_t> frame = encoder.frame(image, coding, zstd, {});
  drawn.content.resize(ZSTD_getFrameContentSize(frame.data(), frame.size()));
  ZSTD_decompress(drawn.content.data(), drawn.content.size(), frame.data(), frame.size());
  return drawn;
}

TEST(RunsFrame, AreExpandedToTheSamplesOfTheServer) {
  std::mt19937 random(59);
  for (int turn = 0; turn < 500; ++turn) {
    const DrawnRuns drawn = draw_runs(random);
    ASSERT_EQ(expand_runs(drawn.spec, drawn.extent, drawn.content, drawn.samples.size()), drawn.samples) << turn;
    EXPECT_LE(drawn.content.size(), most_runs_bytes(drawn.extent, drawn.samples.size()));
  }
}

TEST(RunsFrame, ThatAreCutOrChangedAreRefusedOrExpanded) {
  std::mt19937 random(60);
  for (int turn = 0; turn < 3000; ++turn) {
    DrawnRuns drawn = draw_runs(random);
    std::string& content = drawn.content;
    if (turn % 3 == 0) {
      content.resize(random() % content.size());
      EXPECT_THROW(expand_runs(drawn.spec, drawn.extent, content, drawn.samples.size()), ClientError);
      continue;
    }
    for (int k = 0; k <= turn % 4; ++k) content[random() % content.size()] = static_cast<char>(random());
    try {
      EXPECT_EQ(expand_runs(drawn.spec, drawn.extent, content, drawn.samples.size()).size(), drawn.samples.size());
    } catch (const ClientError& error) {
      EXPECT_EQ(error.reason(), local_reason::kAnswerCorrupt);
    }
  }
}

}  // namespace
}  // namespace ccslice::client
