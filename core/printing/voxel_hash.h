// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Random numbers by counting: a number follows from the voxel and the seed alone, in whatever order voxels are asked
// about. Finalizers of MurmurHash3 and SplitMix64, which pass the usual tests of randomness for such keys.

#pragma once

#include <cstdint>

namespace ccslice {

inline constexpr std::uint64_t mix64(std::uint64_t key) noexcept {
  key += 0x9e3779b97f4a7c15u;
  key = (key ^ key >> 30) * 0xbf58476d1ce4e5b9u;
  key = (key ^ key >> 27) * 0x94d049bb133111ebu;
  return key ^ key >> 31;
}

/// The key of a row of voxels, for random_bits().
inline constexpr std::uint32_t row_key(std::uint64_t seed, std::uint32_t y, std::uint32_t z) noexcept {
  return static_cast<std::uint32_t>(mix64(mix64(seed) ^ (std::uint64_t{z} << 32 | y)));
}

/// 32 random bits for a voxel of a row. Loops over x vectorize.
inline constexpr std::uint32_t random_bits(std::uint32_t key, std::uint32_t x) noexcept {
  std::uint32_t h = key + x * 0x9e3779b1u;
  h = (h ^ h >> 16) * 0x85ebca6bu;
  h = (h ^ h >> 13) * 0xc2b2ae35u;
  return h ^ h >> 16;
}

/// Uniform in (0, 1), 23 bits.
inline float random_unit(std::uint32_t key, std::uint32_t x) noexcept {
  return (static_cast<float>(static_cast<std::int32_t>(random_bits(key, x) >> 9)) + 0.5f) * 0x1p-23f;
}

}  // namespace ccslice
