// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/deflate_block.h"

#include <algorithm>
#include <bit>

#include "core/output/byte_counts.h"

namespace ccslice {
namespace {

SymbolAndExtra distance_symbol(unsigned distance_minus_1) {
  if (distance_minus_1 < 4) return {distance_minus_1, 0, 0};
  const unsigned bits = static_cast<unsigned>(std::bit_width(distance_minus_1)) - 2;
  return {2 * (bits + 1) + (distance_minus_1 >> bits & 1), bits, distance_minus_1 & ((1u << bits) - 1)};
}

void write_stored(std::span<const std::uint8_t> bytes, bool last, BitWriter& out) {
  out.put(last, 3);
  out.align();
  out.put(bytes.size() | (~bytes.size() & 0xffff) << 16, 32);
  out.flush();
  out.put_bytes(bytes.data(), bytes.size());
}

}  // namespace

SymbolAndExtra length_symbol(unsigned length) {
  const unsigned rest = length - 3;
  if (rest < 8) return {257 + rest, 0, 0};
  if (length == DeflateBlock::kLongestMatch) return {285, 0, 0};
  const unsigned bits = static_cast<unsigned>(std::bit_width(rest)) - 3;
  return {257 + 4 * (bits + 1) + (rest >> bits & 3), bits, rest & ((1u << bits) - 1)};
}

void DeflateBlock::count_symbols(std::span<const std::uint8_t> units, const UnitTable& table) {
  literal_counts_.fill(0);
  distance_counts_.fill(0);
  ByteCounts literals;
  std::array<std::uint32_t, kLongestMatch + 1> lengths{};
  std::size_t at = 0;
  for (const Sequence& sequence : sequences_) {
    literals.add(units.subspan(at, sequence.literals));
    at += sequence.literals + sequence.match_units;
    if (sequence.length == 0) continue;
    ++lengths[sequence.length];
    ++distance_counts_[distance_symbol(sequence.distance_minus_1).symbol];
  }
  for (std::size_t unit = 0; unit < table.size(); ++unit) {
    for (std::size_t i = 0; i < table[unit].count; ++i) literal_counts_[table[unit].bytes[i]] += literals[unit];
  }
  for (unsigned length = 3; length <= kLongestMatch; ++length) {
    literal_counts_[length_symbol(length).symbol] += lengths[length];
  }
  literal_counts_[kEndOfBlock] = 1;
}

std::uint64_t DeflateBlock::coded_bits() const {
  std::uint64_t bits = 0;
  for (unsigned symbol = 0; symbol < literal_counts_.size(); ++symbol) {
    const unsigned extra = symbol < 265 || symbol == 285 ? 0 : (symbol - 261) / 4;
    bits += std::uint64_t{literal_counts_[symbol]} * (literal_codes_[symbol].length + extra);
  }
  for (unsigned symbol = 0; symbol < distance_counts_.size(); ++symbol) {
    const unsigned extra = symbol < 4 ? 0 : symbol / 2 - 1;
    bits += std::uint64_t{distance_counts_[symbol]} * (distance_codes_[symbol].length + extra);
  }
  return bits;
}

void DeflateBlock::prepare_bits(const UnitTable& table) {
  const auto append = [](BitString& string, const HuffmanCode& code) {
    string.bits |= std::uint32_t{code.bits} << string.count;
    string.count += code.length;
  };
  first_half_.fill({});
  second_half_.fill({});
  one_byte_units_ = true;
  for (std::size_t unit = 0; unit < table.size(); ++unit) {
    for (std::size_t i = 0; i < table[unit].count; ++i) {
      append(i < 2 ? first_half_[unit] : second_half_[unit], literal_codes_[table[unit].bytes[i]]);
      one_byte_units_ &= i == 0;
    }
  }
  for (unsigned length = 3; length <= kLongestMatch; ++length) {
    const SymbolAndExtra extra = length_symbol(length);
    const HuffmanCode code = literal_codes_[extra.symbol];
    length_bits_[length] = {code.bits | extra.value << code.length, code.length + extra.bits};
  }
}

inline void DeflateBlock::write_literals(std::span<const std::uint8_t> units, BitWriter& out) const {
  std::size_t i = 0;
  if (one_byte_units_) {
    for (; i + 3 <= units.size(); i += 3) {  // 3 * 15 + 7 bits fit.
      for (std::size_t k = 0; k < 3; ++k) out.put(first_half_[units[i + k]].bits, first_half_[units[i + k]].count);
      out.flush();
    }
  }
  for (; i < units.size(); ++i) {
    out.put(first_half_[units[i]].bits, first_half_[units[i]].count);
    out.flush();
    out.put(second_half_[units[i]].bits, second_half_[units[i]].count);
    out.flush();
  }
}

void DeflateBlock::write_sequences(std::span<const std::uint8_t> units, BitWriter& result) const {
  BitWriter out = result;
  std::size_t at = 0;
  for (const Sequence& sequence : sequences_) {
    write_literals(units.subspan(at, sequence.literals), out);
    at += sequence.literals + sequence.match_units;
    if (sequence.length == 0) continue;
    const SymbolAndExtra extra = distance_symbol(sequence.distance_minus_1);
    const HuffmanCode code = distance_codes_[extra.symbol];
    out.put(length_bits_[sequence.length].bits, length_bits_[sequence.length].count);  // 20 bits at most,
    out.put(code.bits, code.length);                                                   // 15,
    out.put(extra.value, extra.bits);                                                  // and 13.
    out.flush();
  }
  result = out;
}

void DeflateBlock::write(std::span<const std::uint8_t> units, const UnitTable& table, bool last, BitWriter& out) {
  count_symbols(units, table);
  make_huffman_codes(literal_counts_, kLongestCode, literal_codes_);
  make_huffman_codes(distance_counts_, kLongestCode, distance_codes_);
  const DynamicBlockHead head(literal_codes_, distance_codes_);
  prepare_bits(table);
  if (!one_byte_units_ || units.empty() || (head.bits() + coded_bits()) / 8 < units.size()) {
    head.write(last, out);
    write_sequences(units, out);
    out.put(literal_codes_[kEndOfBlock].bits, literal_codes_[kEndOfBlock].length);
    out.flush();
  } else {
    for (std::size_t begin = 0; begin < units.size(); begin += kMostStored) {
      write_stored(units.subspan(begin, std::min(units.size() - begin, kMostStored)),
                   last && units.size() - begin <= kMostStored, out);
    }
  }
  sequences_.clear();
}

}  // namespace ccslice
