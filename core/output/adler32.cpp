// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/adler32.h"

#include <immintrin.h>

#include <algorithm>

namespace ccslice {
namespace {

constexpr std::uint32_t kModulus = 65521;
constexpr std::size_t kLanes = 32;
constexpr std::size_t kPiece = 4096;  // Stays in the nearest cache, and no sum overflows.

struct Sums {
  std::uint64_t plain = 0;    // Sum of x_i.
  std::uint64_t falling = 0;  // Sum of (n - 1 - i) x_i.
};

std::uint64_t sum_of_lanes(__m256i lanes) {
  alignas(32) std::array<std::uint64_t, 4> parts;
  _mm256_store_si256(reinterpret_cast<__m256i*>(parts.data()), lanes);
  return parts[0] + parts[1] + parts[2] + parts[3];
}

std::uint64_t sum_of_32_bit_lanes(__m256i lanes) {
  const __m256i zero = _mm256_setzero_si256();
  return sum_of_lanes(_mm256_add_epi64(_mm256_unpacklo_epi32(lanes, zero), _mm256_unpackhi_epi32(lanes, zero)));
}

/// Sums of x_i = map(units[i]), for 32 units at a time. REQUIRES: whole 32s, at most kPiece.
template <class Map>
Sums sums_of(std::span<const std::uint8_t> units, const Map& map) {
  const __m256i zero = _mm256_setzero_si256(), ones = _mm256_set1_epi16(1);
  const __m256i weights = _mm256_setr_epi8(31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13,
                                           12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  __m256i plain = zero, before = zero, within = zero;
  for (std::size_t i = 0; i < units.size(); i += kLanes) {
    const __m256i x = map(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(units.data() + i)));
    before = _mm256_add_epi64(before, plain);
    plain = _mm256_add_epi64(plain, _mm256_sad_epu8(x, zero));
    within = _mm256_add_epi32(within, _mm256_madd_epi16(_mm256_maddubs_epi16(x, weights), ones));
  }
  return {sum_of_lanes(plain), kLanes * sum_of_lanes(before) + sum_of_32_bit_lanes(within)};
}

struct Adler {
  explicit Adler(std::uint32_t value) : a(value & 0xffff), b(value >> 16) {}

  /// n units of `bytes` bytes each.
  void add(std::size_t bytes, std::size_t n, const Sums& sums, std::uint64_t weighted) {
    b = (b + bytes * n * a + bytes * sums.falling + weighted) % kModulus;
    a = (a + sums.plain) % kModulus;
  }
  std::uint32_t value() const { return static_cast<std::uint32_t>(b << 16 | a); }

  std::uint64_t a, b;
};

/// Calls whole(part) for the whole 32s of each piece of the units, rest(unit) for what is left of them.
template <class Whole, class Rest>
void for_each_part(std::span<const std::uint8_t> units, const Whole& whole, const Rest& rest) {
  while (units.size() >= kLanes) {
    const std::size_t count = std::min(units.size(), kPiece) / kLanes * kLanes;
    whole(units.first(count));
    units = units.subspan(count);
  }
  for (const std::uint8_t unit : units) rest(unit);
}

}  // namespace

std::uint32_t adler32_of_bytes(std::uint32_t adler, std::span<const std::uint8_t> bytes) {
  Adler sum(adler);
  for_each_part(
      bytes,
      [&](std::span<const std::uint8_t> part) {
        const Sums sums = sums_of(part, [](__m256i x) { return x; });
        sum.add(1, part.size(), sums, sums.plain);
      },
      [&](std::uint8_t byte) {
        sum.add(1, 1, {byte, 0}, byte);
      });
  return sum.value();
}

/// All S_i are S and all W_i W: their sums are n S, c S n (n - 1) / 2 and n W.
std::uint32_t adler32_of_repeats(std::uint32_t adler, std::span<const std::uint8_t> bytes, std::uint64_t count) {
  Adler sum(adler);
  std::uint64_t once = 0, weighted = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    once += bytes[k];
    weighted += (bytes.size() - k) * bytes[k];
  }
  constexpr std::uint64_t kMost = 1 << 20;  // No product below overflows.
  for (std::uint64_t left = count; left > 0;) {
    const std::uint64_t n = std::min(left, kMost);
    sum.add(bytes.size(), n, {once * n, once * (n * (n - 1) / 2 % kModulus)}, weighted * n);
    left -= n;
  }
  return sum.value();
}

ColourAdler32::ColourAdler32(std::span<const std::array<std::uint8_t, 4>> palette) {
  for (std::size_t i = 0; i < palette.size(); ++i) {
    const auto& [red, green, blue, alpha] = palette[i];
    const unsigned sum = red + green + blue + alpha, weighted = 4 * red + 3 * green + 2 * blue + alpha;
    sum_low_[i] = static_cast<std::uint8_t>(sum);
    sum_high_[i] = static_cast<std::uint8_t>(sum >> 8);
    weighted_low_[i] = static_cast<std::uint8_t>(weighted);
    weighted_high_[i] = static_cast<std::uint8_t>(weighted >> 8);
  }
}

std::uint32_t ColourAdler32::operator()(std::uint32_t adler, std::span<const std::uint8_t> indices) const {
  Adler sum(adler);
  const auto sums = [](const Table& table, std::span<const std::uint8_t> part) {
    const __m128i half = _mm_loadu_si128(reinterpret_cast<const __m128i*>(table.data()));
    const __m256i both = _mm256_broadcastsi128_si256(half);
    return sums_of(part, [both](__m256i index) { return _mm256_shuffle_epi8(both, index); });
  };
  for_each_part(
      indices,
      [&](std::span<const std::uint8_t> part) {
        const Sums low = sums(sum_low_, part), high = sums(sum_high_, part);
        const std::uint64_t weighted = sums(weighted_low_, part).plain + 256 * sums(weighted_high_, part).plain;
        sum.add(4, part.size(), {low.plain + 256 * high.plain, low.falling + 256 * high.falling}, weighted);
      },
      [&](std::uint8_t i) {
        sum.add(4, 1, {sum_low_[i] + 256u * sum_high_[i], 0}, weighted_low_[i] + 256u * weighted_high_[i]);
      });
  return sum.value();
}

}  // namespace ccslice
