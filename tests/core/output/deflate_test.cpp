// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <functional>
#include <random>

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// By zlib, which checks the sum at the end.
Bytes inflated(const Bytes& stream, std::size_t size) {
  Bytes bytes(size + 1);
  uLongf found = bytes.size();
  EXPECT_EQ(uncompress(bytes.data(), &found, stream.data(), stream.size()), Z_OK);
  bytes.resize(found);
  return bytes;
}

Bytes deflated(const Bytes& bytes) {
  ZlibStream stream;
  stream.start_bytes();
  stream.append(bytes);
  return stream.finish();
}

/// Different kinds of data, by name.
struct ByteKind {
  const char* name;
  std::function<std::uint8_t(std::size_t i, std::mt19937& random)> byte;
};

const ByteKind kByteKinds[] = {
    {"zeros", [](std::size_t, std::mt19937&) { return 0; }},
    {"noise", [](std::size_t, std::mt19937& random) { return static_cast<std::uint8_t>(random()); }},
    {"two values", [](std::size_t, std::mt19937& random) { return static_cast<std::uint8_t>(random() % 2); }},
    {"skewed",
     [](std::size_t, std::mt19937& random) { return static_cast<std::uint8_t>(random() % 16 * random() % 16); }},
    {"period 300", [](std::size_t i, std::mt19937&) { return static_cast<std::uint8_t>(i % 300 * 7 / 3); }},
    {"period 32768", [](std::size_t i, std::mt19937&) { return static_cast<std::uint8_t>(i % 32768 * 31 >> 3); }},
    {"runs", [](std::size_t i, std::mt19937&) { return static_cast<std::uint8_t>(i / 1000); }},
    {"noise between runs",
     [](std::size_t i, std::mt19937& random) { return static_cast<std::uint8_t>(i / 700 % 2 ? random() : 9); }},
};

Bytes bytes_of(const ByteKind& kind, std::size_t size) {
  std::mt19937 random(11);
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = kind.byte(i, random);
  return bytes;
}

TEST(ZlibStream, InflatesToTheBytes) {
  for (const ByteKind& kind : kByteKinds) {
    for (const std::size_t size : {1u, 7u, 8u, 9u, 500u, 65'535u, 131'072u, 131'073u, 1'000'000u}) {
      const Bytes bytes = bytes_of(kind, size);
      EXPECT_TRUE(inflated(deflated(bytes), size) == bytes) << kind.name << ", " << size;
    }
  }
}

TEST(ZlibStream, StoresWhatCannotBeCompressed) {
  EXPECT_LE(deflated(bytes_of(kByteKinds[1], 1'000'000)).size(), 1'000'200u);
  EXPECT_LE(deflated(bytes_of(kByteKinds[0], 1'000'000)).size(), 2'000u);
}

TEST(ZlibStream, DoesNotDependOnThePiecesNorOnThePast) {
  std::mt19937 random(12);
  ZlibStream used;
  for (const ByteKind& kind : kByteKinds) {
    const Bytes bytes = bytes_of(kind, 400'000);
    used.start_bytes();
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t count = std::min<std::size_t>(bytes.size() - at, 1 + random() % 50'000);
      used.append(std::span(bytes).subspan(at, count));
      at += count;
    }
    EXPECT_TRUE(used.finish() == deflated(bytes)) << kind.name;
  }
}

/// Rows of noise and rows of zeros in turns: as the stream's calls, and as the bytes that they stand for.
TEST(ZlibStream, RowsOfZerosInflateToZeros) {
  std::mt19937 random(14);
  for (const std::size_t row : {2u, 300u, 46'301u}) {
    for (const std::uint64_t zero_rows : {1u, 2u, 257u, 258u, 259u, 5'000u}) {
      for (const std::size_t noise_rows : {0u, 1u, 40u}) {
        ZlibStream stream;
        stream.start_bytes();
        Bytes bytes;
        for (int turn = 0; turn < 2; ++turn) {
          stream.append_equal_rows(zero_rows, row, 0);
          bytes.insert(bytes.end(), zero_rows * row, 0);
          Bytes noise(noise_rows * row);
          for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random() % 3);
          stream.append(noise);
          bytes.insert(bytes.end(), noise.begin(), noise.end());
        }
        EXPECT_TRUE(inflated(stream.finish(), bytes.size()) == bytes) << row << ", " << zero_rows << ", " << noise_rows;
      }
    }
  }
}

TEST(ZlibStream, EqualRowsOfColoursInflateToThem) {
  std::mt19937 random(15);
  for (const Colour& background : {Colour{}, Colour{0, 0, 0, 255}, Colour{7, 7, 7, 7}, Colour{200, 0, 3, 9}}) {
    const std::array<Colour, 2> palette{background, Colour{255, 0, 0, 255}};
    for (const std::size_t width : {1u, 2u, 3u, 65u, 66u, 99u, 11'575u}) {
      ZlibStream stream;
      stream.start_colours(palette, width + 1);
      Bytes bytes;
      const auto add = [&](std::size_t unit) { bytes.insert(bytes.end(), palette[unit].begin(), palette[unit].end()); };
      for (int turn = 0; turn < 3; ++turn) {
        for (int y = 0; y < 30; ++y) {
          Bytes units{ZlibStream::kSeparator};
          bytes.push_back(0);
          for (std::size_t x = 0; x < width; ++x) {
            units.push_back(random() % 4 == 0);
            add(units.back());
          }
          stream.append(units);
        }
        stream.append_equal_rows(70, width + 1, 0);
        for (int y = 0; y < 70; ++y) {
          bytes.push_back(0);
          for (std::size_t x = 0; x < width; ++x) add(0);
        }
      }
      EXPECT_TRUE(inflated(stream.finish(), bytes.size()) == bytes) << width << ", " << int{background[0]};
    }
  }
}

TEST(ZlibStream, EqualRowsTakeAQuarterOfAByteEach258) {
  constexpr std::uint64_t kRows = 4'606, kBytes = kRows * (1 + 4 * 11'575);
  for (const Colour& background : {Colour{}, Colour{255, 255, 255, 255}}) {
    ZlibStream stream;
    stream.start_colours({&background, 1}, 11'576);
    stream.append_equal_rows(kRows, 11'576, 0);
    EXPECT_LE(stream.finish().size(), kBytes / (4 * 258) + (background[3] == 0 ? 300 : 10 * kRows));
  }
}

struct ColourPicture {
  std::size_t width, height, colours;
  int pattern;  // 0: noise, 1: a repeated dither with noise, 2: stripes.
};

class ZlibStreamOfColours : public testing::TestWithParam<ColourPicture> {};

TEST_P(ZlibStreamOfColours, InflatesToTheirBytes) {
  const auto [width, height, colours, pattern] = GetParam();
  std::mt19937 random(13);
  std::vector<Colour> palette(colours);
  for (Colour& colour : palette) {
    for (std::uint8_t& component : colour) component = static_cast<std::uint8_t>(random());
  }
  Bytes units, bytes;
  for (std::size_t y = 0; y < height; ++y) {
    units.push_back(ZlibStream::kSeparator);
    bytes.push_back(0);
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t dither = random() % 50 == 0 ? random() : (x % 64 * 7919 + y % 64 * 104729) % 613;
      const std::size_t value = pattern == 0 ? random() : pattern == 1 ? dither : y / 3 + x / 200;
      units.push_back(static_cast<std::uint8_t>(value % colours));
      bytes.insert(bytes.end(), palette[value % colours].begin(), palette[value % colours].end());
    }
  }
  ZlibStream stream;
  stream.start_colours(palette, width + 1);
  stream.append(units);
  EXPECT_TRUE(inflated(stream.finish(), bytes.size()) == bytes);
}

INSTANTIATE_TEST_SUITE_P(Pictures, ZlibStreamOfColours,
                         testing::Values(ColourPicture{1, 1, 1, 0}, ColourPicture{1, 70'000, 2, 0},
                                         ColourPicture{2, 50'000, 3, 1}, ColourPicture{3, 40'000, 16, 0},
                                         ColourPicture{7, 9'000, 2, 2}, ColourPicture{64, 3'000, 4, 1},
                                         ColourPicture{997, 300, 9, 1}, ColourPicture{4096, 100, 4, 0},
                                         ColourPicture{65'536, 5, 4, 1}, ColourPicture{65'536, 4, 2, 2},
                                         ColourPicture{300'000, 2, 16, 0}));

}  // namespace
}  // namespace ccslice
