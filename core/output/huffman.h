// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Huffman codes of bounded length as deflate uses them (RFC 1951, 3.2.2 and 3.2.7). The same counts give the same code
// on every machine: ties are broken by the symbol.

#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/output/bit_writer.h"

namespace ccslice {

inline constexpr unsigned kLongestCode = 15;  // Bits, in deflate.

/// A symbol's code, ready to be put: its bits in reverse order. length == 0: the symbol doesn't occur.
struct HuffmanCode {
  std::uint16_t bits = 0;
  std::uint16_t length = 0;
};

/// Codes of the symbols that occur. Where fewer than two do, others get a code too, so that it is always complete.
/// REQUIRES: 2 <= counts.size() == codes.size() <= 288, the counts' sum below 2^32,
/// log2(counts.size()) <= max_length <= kLongestCode
void make_huffman_codes(std::span<const std::uint32_t> counts, unsigned max_length, std::span<HuffmanCode> codes);

/// The head of a block with codes of its own, from BFINAL on.
class DynamicBlockHead {
 public:
  DynamicBlockHead(std::span<const HuffmanCode> literals, std::span<const HuffmanCode> distances);

  std::uint64_t bits() const;
  void write(bool last_block, BitWriter& out) const;

 private:
  struct Step {
    std::uint8_t symbol;
    std::uint8_t extra;
  };
  void add_run(unsigned length, unsigned count);
  void add_step(unsigned symbol, unsigned extra);
  unsigned code_length_codes() const;

  unsigned literal_codes_, distance_codes_;
  std::array<Step, 320> steps_;
  unsigned step_count_ = 0;
  std::array<std::uint32_t, 19> counts_{};
  std::array<HuffmanCode, 19> codes_{};
};

}  // namespace ccslice
