// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

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
