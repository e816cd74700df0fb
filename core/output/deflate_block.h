// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One block of a deflate stream [RFC 1951, 3.2]: literals and matches, and the bits that they become.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/output/bit_writer.h"
#include "core/output/huffman.h"

namespace ccslice {

/// What a unit stands for: one byte, or the four of a colour.
struct UnitBytes {
  std::array<std::uint8_t, 4> bytes{};
  std::uint8_t count = 1;
};

using UnitTable = std::array<UnitBytes, 256>;

/// A symbol and the bits that follow it.
struct SymbolAndExtra {
  unsigned symbol;
  unsigned bits;
  unsigned value;
};

/// `length`: a match's, in bytes, 3 to DeflateBlock::kLongestMatch.
SymbolAndExtra length_symbol(unsigned length);

inline constexpr unsigned kEndOfBlock = 256;

class DeflateBlock {
 public:
  static constexpr std::size_t kLongestMatch = 258;

  /// Adds so many units as they are, then a match of `match_units` units, at most kLongestMatch. `length`: its bytes, 3
  /// to kLongestMatch; `distance`: how many bytes before it the same ones begin, 1 to 32768.
  void add(std::size_t literals, std::size_t match_units, std::size_t length, std::size_t distance) {
    sequences_.push_back({static_cast<std::uint32_t>(literals), static_cast<std::uint16_t>(match_units),
                          static_cast<std::uint16_t>(length), static_cast<std::uint16_t>(distance - 1)});
  }
  /// Adds so many units as they are.
  void add(std::size_t literals) { sequences_.push_back({static_cast<std::uint32_t>(literals), 0, 0, 0}); }
  /// The most bytes that write() takes for units of that many bytes in all.
  static constexpr std::size_t largest(std::size_t unit_bytes) {
    return unit_bytes + 5 * (unit_bytes / kMostStored + 1) + kLargestHead;
  }
  /// Writes what was added, and forgets it: coded, or, if units are bytes and that is shorter, stored. `units`: all
  /// that it covers.
  void write(std::span<const std::uint8_t> units, const UnitTable& table, bool last, BitWriter& out);

 private:
  static constexpr std::size_t kMostStored = 65535;
  static constexpr std::size_t kLargestHead = 512;

  struct Sequence {
    std::uint32_t literals;
    std::uint16_t match_units;
    std::uint16_t length;  // 0: no match.
    std::uint16_t distance_minus_1;
  };
  struct BitString {
    std::uint32_t bits;
    std::uint32_t count;
  };

  void count_symbols(std::span<const std::uint8_t> units, const UnitTable& table);
  std::uint64_t coded_bits() const;
  void prepare_bits(const UnitTable& table);
  void write_sequences(std::span<const std::uint8_t> units, BitWriter& out) const;
  void write_literals(std::span<const std::uint8_t> units, BitWriter& out) const;

  std::vector<Sequence> sequences_;
  std::array<std::uint32_t, 286> literal_counts_;  // Bytes, the end of the block, lengths.
  std::array<std::uint32_t, 30> distance_counts_;
  std::array<HuffmanCode, 286> literal_codes_;
  std::array<HuffmanCode, 30> distance_codes_;
  std::array<BitString, 256> first_half_,
      second_half_;  // The codes of a unit's bytes; second_half_ is empty for units of one byte.
  std::array<BitString, kLongestMatch + 1> length_bits_;
  bool one_byte_units_ = true;
};

}  // namespace ccslice
