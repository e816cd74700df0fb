// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/pack_indices.h"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.h"
#include "core/output/encode.h"

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes packed(const Bytes& indices, std::uint32_t width, std::uint32_t bits) {
  Bytes result;
  pack_indices({width, static_cast<std::uint32_t>(indices.size() / width), indices, {}}, bits, result, {});
  return result;
}

TEST(PackIndices, PutsTheFirstVoxelOnTopAndPadsRows) {
  EXPECT_EQ(packed({1, 0, 1, 1, 0, 0, 0, 0, 1}, 9, 1), (Bytes{0b10110000, 0b10000000}));
  EXPECT_EQ(packed({3, 2, 1, 0, 1, 2, 0, 3, 0, 3}, 5, 2), (Bytes{0b11100100, 0b01000000, 0b10001100, 0b11000000}));
  EXPECT_EQ(packed({15, 1, 8, 4, 5, 6}, 3, 4), (Bytes{0xf1, 0x80, 0x45, 0x60}));
  EXPECT_EQ(packed({7, 255}, 1, 8), (Bytes{7, 255}));
}

TEST(PackIndices, TakesTheBytesThatSampleBytesSays) {
  std::mt19937 random(17);
  for (const SampleType type : {SampleType::kBit, SampleType::kUint2, SampleType::kUint4, SampleType::kUint8}) {
    for (std::uint32_t width = 1; width < 20; ++width) {
      Bytes indices(width * 3);
      for (std::uint8_t& index : indices) index = static_cast<std::uint8_t>(random() % (1u << bits_per_index(type)));
      const Bytes bytes = packed(indices, width, bits_per_index(type));
      ASSERT_EQ(bytes.size(), sample_bytes(type, width, 3));
      const std::uint32_t bits = bits_per_index(type);
      for (std::uint32_t i = 0; i < indices.size(); ++i) {
        const std::size_t bit = i / width * (bytes.size() / 3) * 8 + i % width * bits;
        EXPECT_EQ(bytes[bit / 8] >> (8 - bits - bit % 8) & ((1u << bits) - 1), indices[i]);
      }
    }
  }
}

TEST(PackIndices, MasksShowTheirMaterials) {
  const Bytes indices = {0, 1, 2, 2, 1, 0, 2, 0, 2, 1};
  Bytes mask;
  pack_mask({5, 2, indices, {}}, 1U << 2, mask, {});
  EXPECT_EQ(mask, (Bytes{0b00110000, 0b01010000}));
  pack_mask({5, 2, indices, {}}, 1U << 1 | 1U << 2, mask, {});
  EXPECT_EQ(mask, (Bytes{0b01111000, 0b01011000}));
  pack_mask({5, 2, indices, {}}, 0, mask, {});
  EXPECT_EQ(mask, (Bytes{0, 0}));
}

TEST(CountMaterials, CountsEveryVoxelOnce) {
  const std::vector<std::uint32_t> palette = {0, 1, 2, 3};
  Bytes indices(1000 * 7);
  std::vector<std::uint64_t> expected(4);
  std::mt19937 random(3);
  for (std::uint8_t& index : indices) ++expected[index = static_cast<std::uint8_t>(random() % 4)];
  EXPECT_EQ(count_materials({1000, 7, indices, palette}, {}), expected);
}

TEST(CountMaterials, RefusesANumberBeyondThePalette) {
  const std::vector<std::uint32_t> palette = {0, 1};
  EXPECT_THROW(count_materials({2, 2, Bytes{0, 1, 2, 0}, palette}, {}), Error);
  EXPECT_THROW(PlaneEncoder().encode({2, 2, Bytes{0, 1, 255, 0}, palette}, SampleType::kUint8, Encoding::kPngRgba),
               Error);
  EXPECT_THROW(PlaneEncoder().encode({2, 2, Bytes{0, 1, 2, 0}, palette}, SampleType::kUint2, Encoding::kPng), Error);
}

TEST(SmallestIndexType, HoldsAllMaterials) {
  EXPECT_EQ(smallest_index_type(1), SampleType::kBit);
  EXPECT_EQ(smallest_index_type(2), SampleType::kUint2);
  EXPECT_EQ(smallest_index_type(3), SampleType::kUint2);
  EXPECT_EQ(smallest_index_type(4), SampleType::kUint4);
  EXPECT_EQ(smallest_index_type(8), SampleType::kUint4);
}

TEST(IndexEncodingObstacle, NamesTypesThatAreTooNarrow) {
  EXPECT_FALSE(index_encoding_obstacle(SampleType::kUint2, Encoding::kRawZstd, 3));
  EXPECT_TRUE(index_encoding_obstacle(SampleType::kUint2, Encoding::kRawZstd, 4));
  EXPECT_TRUE(index_encoding_obstacle(SampleType::kFloat32, Encoding::kRaw, 1));
  EXPECT_TRUE(index_encoding_obstacle(SampleType::kUint8, Encoding::kTiff, 1));
}

TEST(CopyBits, TakesThemFromAnywhereToAnywhere) {
  const std::vector<std::uint8_t> in = {0b10110011, 0b01011100, 0b11110000};
  const auto bit = [](const std::vector<std::uint8_t>& bytes, std::size_t at) {
    return bytes[at / 8] >> (7 - at % 8) & 1;
  };
  for (std::size_t from = 0; from < 24; ++from) {
    for (std::size_t count = 0; from + count <= 24; ++count) {
      for (std::size_t to = 0; to < 17; ++to) {
        std::vector<std::uint8_t> out(6);
        copy_bits(in.data(), from, count, out.data(), to);
        for (std::size_t at = 0; at < 48; ++at) {
          const bool is_copied = at >= to && at < to + count;
          ASSERT_EQ(bit(out, at), is_copied ? bit(in, from + at - to) : 0) << from << ' ' << count << ' ' << to;
        }
      }
    }
  }
}

TEST(CopyBits, LongRowsAreCopiedBySeveralBytesAtOnce) {
  std::mt19937 random(5);
  std::vector<std::uint8_t> in(40);
  for (std::uint8_t& byte : in) byte = static_cast<std::uint8_t>(random());
  const auto bit = [](const std::vector<std::uint8_t>& bytes, std::size_t at) {
    return bytes[at / 8] >> (7 - at % 8) & 1;
  };
  for (std::size_t from = 0; from < 9; ++from) {
    for (std::size_t to = 0; to < 9; ++to) {
      for (const std::size_t count : {63u, 64u, 65u, 119u, 120u, 128u, 200u, 311u}) {
        std::vector<std::uint8_t> out(44);
        copy_bits(in.data(), from, count, out.data(), to);
        for (std::size_t at = 0; at < 8 * out.size(); ++at) {
          const bool is_copied = at >= to && at < to + count;
          ASSERT_EQ(bit(out, at), is_copied ? bit(in, from + at - to) : 0) << from << ' ' << count << ' ' << to;
        }
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
