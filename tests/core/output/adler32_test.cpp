// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/adler32.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <random>
#include <vector>

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::uint32_t zlibs(std::uint32_t adler, const Bytes& bytes) {
  return static_cast<std::uint32_t>(bytes.empty() ? adler : adler32_z(adler, bytes.data(), bytes.size()));
}

const std::size_t kSizes[] = {0, 1, 31, 32, 33, 4095, 4096, 4097, 100'003, 1'000'000};

TEST(Adler32, OfBytesIsThatOfZlib) {
  std::mt19937 random(1);
  for (const std::size_t size : kSizes) {
    Bytes bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const std::uint32_t before = zlibs(1, Bytes(size % 1000, 255));
    EXPECT_EQ(adler32_of_bytes(before, bytes), zlibs(before, bytes)) << size;
  }
}

TEST(Adler32, DoesNotOverflow) {
  const Bytes bytes(5'000'000, 255);
  EXPECT_EQ(adler32_of_bytes(0xfff0fff0, bytes), zlibs(0xfff0fff0, bytes));
}

TEST(Adler32, OfColoursIsThatOfTheirBytes) {
  std::mt19937 random(2);
  for (const std::size_t colours : {1u, 2u, 9u, 16u}) {
    std::vector<std::array<std::uint8_t, 4>> palette(colours);
    for (auto& colour : palette) {
      for (std::uint8_t& component : colour) component = static_cast<std::uint8_t>(random() % 3 ? 255 : random());
    }
    for (const std::size_t size : kSizes) {
      Bytes indices(size), bytes;
      for (std::uint8_t& index : indices) {
        index = static_cast<std::uint8_t>(random() % colours);
        bytes.insert(bytes.end(), palette[index].begin(), palette[index].end());
      }
      EXPECT_EQ(ColourAdler32(palette)(77, indices), zlibs(77, bytes)) << size << " of " << colours;
    }
  }
}

TEST(Adler32, RepeatsAreWhatTheyRepeat) {
  for (const Bytes& unit : {Bytes{0}, Bytes{255}, Bytes{1, 2, 3, 4}, Bytes{255, 255, 255, 255}}) {
    for (const std::size_t count : {0u, 1u, 2u, 5'552u, 3'000'000u}) {
      Bytes bytes;
      for (std::size_t k = 0; k < count; ++k) bytes.insert(bytes.end(), unit.begin(), unit.end());
      for (const std::uint32_t before : {1u, 65'520u << 16 | 65'520u}) {
        EXPECT_EQ(adler32_of_repeats(before, unit, count), adler32_of_bytes(before, bytes)) << count;
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
