// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Adler-32 [RFC 1950]: a is 1 and the sum of all bytes, b the sum of all values of a. Of units that stand for c bytes
// d_1 ... d_c each, n of them take (a, b) to
//
//     a' = a + sum of S_i                                            S = sum of d_k
//     b' = b + c n a + sum of (c (n - 1 - i) S_i + W_i)              W = sum of (c + 1 - k) d_k
//
// so what counts is sums over units, whatever they stand for.

#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace ccslice {

/// Goes on with some bytes. Begins with 1.
std::uint32_t adler32_of_bytes(std::uint32_t adler, std::span<const std::uint8_t> bytes);

/// Goes on with `count` times the same bytes, of up to 4.
std::uint32_t adler32_of_repeats(std::uint32_t adler, std::span<const std::uint8_t> bytes, std::uint64_t count);

/// Goes on with the colours that some indices stand for, of up to 16, without spelling them out.
class ColourAdler32 {
 public:
  /// REQUIRES: at most 16 colours.
  explicit ColourAdler32(std::span<const std::array<std::uint8_t, 4>> palette);
  /// REQUIRES: indices of the palette.
  std::uint32_t operator()(std::uint32_t adler, std::span<const std::uint8_t> indices) const;

 private:
  using Table = std::array<std::uint8_t, 16>;
  Table sum_low_{}, sum_high_{}, weighted_low_{}, weighted_high_{};  // S and W of each colour, byte by byte.
};

}  // namespace ccslice
