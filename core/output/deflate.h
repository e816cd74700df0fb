// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// zlib streams [RFC 1950, 1951] of pictures with few colours, made several times faster than by general compressors,
// and the same bytes on every machine: integers only, and no choice of code by the processor.
//
// A stream is made of UNITS. A unit is a byte that stands for itself, or an index that stands for the four bytes of a
// voxel's colour. Matches are looked for among units, so a picture of 32-bit colours costs what its indices cost, and
// the patterns of a dither are found voxel by voxel.
//
// Matches are greedy, at the last place where 8 or 4 units began so. Blocks of units get Huffman codes of their own, or
// are stored where that is shorter. Rows of one unit cost nothing but their bits: a quarter of a byte for 258 bytes.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace ccslice {

using Colour = std::array<std::uint8_t, 4>;  // Red, green, blue, alpha; not premultiplied.

class ZlibStream {
 public:
  /// A unit of colours that stands for one byte 0: the filter type in front of a PNG row.
  static constexpr std::uint8_t kSeparator = 255;
  static constexpr std::size_t kMostColours = 16;

  ZlibStream();
  ~ZlibStream();
  ZlibStream(ZlibStream&&) noexcept;
  ZlibStream& operator=(ZlibStream&&) noexcept;

  /// Forgets everything; units are bytes from now on.
  void start_bytes();
  /// Forgets everything; from now on units are indices of `palette`. Every `row_units` units begin with kSeparator.
  /// REQUIRES: at most kMostColours.
  void start_colours(std::span<const Colour> palette, std::size_t row_units);

  /// REQUIRES: started; units within the palette. How units are split over calls makes no difference.
  void append(std::span<const std::uint8_t> units);
  /// Rows of a byte 0 and then `row_units` - 1 times one unit. No unit after them is matched with one before. REQUIRES:
  /// at least one row, of at least two units, in colours of as many as start_colours() was told; started; in colours,
  /// whole rows before.
  void append_equal_rows(std::uint64_t rows, std::size_t row_units, std::uint8_t unit);
  /// The whole stream. REQUIRES: at least one unit.
  std::vector<std::uint8_t> finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
