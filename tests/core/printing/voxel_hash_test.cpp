// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/voxel_hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace ccslice {
namespace {

// The first numbers of SplitMix64 from 0, as its authors' program prints them.
TEST(VoxelHash, MixesAsSplitMix64) {
  constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15u;
  EXPECT_EQ(mix64(0), 0xe220a8397b1dcdafu);
  EXPECT_EQ(mix64(kStep), 0x6e789e6aa1b965f4u);
  EXPECT_EQ(mix64(2 * kStep), 0x06c45d188009454fu);
}

TEST(VoxelHash, FinishesAsMurmurHash3) {
  EXPECT_EQ(random_bits(0, 0), 0u);
  EXPECT_EQ(random_bits(1, 0), 0x514e28b7u);
  EXPECT_EQ(random_bits(0, 1), random_bits(0x9e3779b1u, 0));
}

TEST(VoxelHash, UnitsAreWithinZeroAndOneAndEven) {
  constexpr std::uint32_t kCount = 1 << 20, kBins = 64;
  std::array<double, kBins> bins{};
  float least = 1, most = 0;
  for (std::uint32_t x = 0; x < kCount; ++x) {
    const float unit = random_unit(row_key(7, 3, 5), x);
    least = std::min(least, unit);
    most = std::max(most, unit);
    ++bins[static_cast<std::size_t>(unit * kBins)];
  }
  EXPECT_GT(least, 0);
  EXPECT_LT(most, 1);
  double chi_squared = 0;
  for (const double count : bins) chi_squared += std::pow(count - kCount / kBins, 2) / (kCount / kBins);
  EXPECT_LT(chi_squared, 120);  // 63 degrees of freedom: 1 in 50,000.
  EXPECT_GT(chi_squared, 25);
}

// Rows whose y, z or seed differ by little have nothing to do with each other.
TEST(VoxelHash, NeighbouringRowsDontCorrelate) {
  constexpr std::uint32_t kCount = 1 << 16;
  const std::uint32_t key = row_key(1, 10, 20);
  for (const std::uint32_t other : {row_key(1, 11, 20), row_key(1, 10, 21), row_key(2, 10, 20), row_key(1, 20, 10)}) {
    ASSERT_NE(key, other);
    double products = 0;
    int equal_bits = 0;
    for (std::uint32_t x = 0; x < kCount; ++x) {
      products += (random_unit(key, x) - 0.5) * (random_unit(other, x) - 0.5);
      equal_bits += 32 - std::popcount(random_bits(key, x) ^ random_bits(other, x));
    }
    EXPECT_LT(std::abs(12 * products / kCount), 5 / std::sqrt(kCount));
    EXPECT_NEAR(equal_bits / (32.0 * kCount), 0.5, 5 * 0.5 / std::sqrt(32.0 * kCount));
  }
}

}  // namespace
}  // namespace ccslice
