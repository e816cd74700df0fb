// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/huffman.h"

#include <algorithm>
#include <vector>

namespace ccslice {
namespace {

constexpr std::size_t kMostSymbols = 288;
constexpr std::uint8_t kLengthOrder[19] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
constexpr unsigned kRepeat = 16, kZeros = 17, kManyZeros = 18;
constexpr std::uint8_t kExtraBits[3] = {2, 3, 7};  // Extra bits of these three.

struct Leaf {
  std::uint32_t count;
  std::uint16_t symbol;
};

/// How many codes of every length the optimal tree over ascending counts has, by the two-queue method in place.
using LengthCounts = std::array<std::uint32_t, kMostSymbols>;

LengthCounts optimal_lengths(std::span<const Leaf> leaves) {
  const std::size_t n = leaves.size();
  std::array<std::uint32_t, kMostSymbols> weight;  // Weights of inner nodes, made in ascending order.
  std::array<std::uint16_t, 2 * kMostSymbols> parent;
  std::size_t leaf = 0, inner = 0;
  for (std::size_t made = 0; made + 1 < n; ++made) {
    std::uint32_t sum = 0;
    for (int child = 0; child < 2; ++child) {
      const bool take_leaf = leaf < n && (inner == made || leaves[leaf].count <= weight[inner]);
      sum += take_leaf ? leaves[leaf].count : weight[inner];
      parent[take_leaf ? leaf++ : n + inner++] = static_cast<std::uint16_t>(made);
    }
    weight[made] = sum;
  }
  std::array<std::uint16_t, kMostSymbols> depth;
  depth[n - 2] = 0;
  for (std::size_t node = n - 2; node-- > 0;) depth[node] = static_cast<std::uint16_t>(depth[parent[n + node]] + 1);
  LengthCounts counts{};
  for (std::size_t i = 0; i < n; ++i) ++counts[depth[parent[i]] + 1u];
  return counts;
}

/// Shortens what is too long and pays for it where that costs least, until the code is complete again.
void limit_lengths(LengthCounts& counts, unsigned max_length) {
  for (std::size_t length = max_length + 1; length < counts.size(); ++length) {
    counts[max_length] += counts[length];
    counts[length] = 0;
  }
  std::uint64_t used = 0;  // In units of the longest code.
  for (unsigned length = 1; length <= max_length; ++length) {
    used += std::uint64_t{counts[length]} << (max_length - length);
  }
  // A shorter code becomes two that are longer by one, for its own symbol and one of the longest. Of the shorter one's
  // 2^k units each takes a half, and the unit of the longest is saved.
  for (; used > std::uint64_t{1} << max_length; --used) {
    unsigned length = max_length - 1;
    while (counts[length] == 0) --length;
    --counts[length];
    counts[length + 1] += 2;
    --counts[max_length];
  }
}

std::uint16_t reversed(unsigned bits, unsigned length) {
  unsigned result = 0;
  for (unsigned i = 0; i < length; ++i) result |= (bits >> i & 1) << (length - 1 - i);
  return static_cast<std::uint16_t>(result);
}

void number_codes(const LengthCounts& counts, std::span<HuffmanCode> codes) {
  std::array<unsigned, kLongestCode + 2> next{};
  for (unsigned length = 1; length <= kLongestCode; ++length) next[length + 1] = (next[length] + counts[length]) << 1;
  for (HuffmanCode& code : codes) {
    if (code.length > 0) code.bits = reversed(next[code.length]++, code.length);
  }
}

std::size_t last_used(std::span<const HuffmanCode> codes, std::size_t at_least) {
  std::size_t size = codes.size();
  while (size > at_least && codes[size - 1].length == 0) --size;
  return size;
}

}  // namespace

void make_huffman_codes(std::span<const std::uint32_t> counts, unsigned max_length, std::span<HuffmanCode> codes) {
  std::array<Leaf, kMostSymbols> leaves;
  std::size_t used = 0;
  std::ranges::fill(codes, HuffmanCode{});
  for (std::size_t symbol = 0; symbol < counts.size(); ++symbol) {
    if (counts[symbol] > 0) leaves[used++] = {counts[symbol], static_cast<std::uint16_t>(symbol)};
  }
  for (std::uint16_t symbol = 0; used < 2; ++symbol) {
    if (counts[symbol] == 0) leaves[used++] = {0, symbol};
  }
  const std::span<Leaf> occurring(leaves.data(), used);
  std::ranges::sort(occurring, [](const Leaf& a, const Leaf& b) {
    return a.count != b.count ? a.count < b.count : a.symbol < b.symbol;
  });
  LengthCounts lengths = optimal_lengths(occurring);
  limit_lengths(lengths, max_length);
  std::size_t leaf = 0;
  for (unsigned length = max_length; length > 0; --length) {
    for (std::uint32_t i = 0; i < lengths[length]; ++i) {
      codes[occurring[leaf++].symbol].length = static_cast<std::uint16_t>(length);
    }
  }
  number_codes(lengths, codes);
}

DynamicBlockHead::DynamicBlockHead(std::span<const HuffmanCode> literals, std::span<const HuffmanCode> distances)
    : literal_codes_(static_cast<unsigned>(last_used(literals, 257))),
      distance_codes_(static_cast<unsigned>(last_used(distances, 1))) {
  std::array<std::uint8_t, 320> lengths;
  unsigned size = 0;
  for (const HuffmanCode& code : literals.first(literal_codes_))
    lengths[size++] = static_cast<std::uint8_t>(code.length);
  for (const HuffmanCode& code : distances.first(distance_codes_)) {
    lengths[size++] = static_cast<std::uint8_t>(code.length);
  }
  for (unsigned at = 0; at < size;) {
    unsigned end = at + 1;
    while (end < size && lengths[end] == lengths[at]) ++end;
    add_run(lengths[at], end - at);
    at = end;
  }
  make_huffman_codes(counts_, 7, codes_);
}

void DynamicBlockHead::add_run(unsigned length, unsigned count) {
  if (length == 0) {
    for (; count >= 11; count -= std::min(count, 138u)) add_step(kManyZeros, std::min(count, 138u) - 11);
    if (count >= 3) return add_step(kZeros, count - 3);
  } else if (count > 0) {
    add_step(length, 0);
    for (--count; count >= 3; count -= std::min(count, 6u)) add_step(kRepeat, std::min(count, 6u) - 3);
  }
  for (; count > 0; --count) add_step(length, 0);
}

void DynamicBlockHead::add_step(unsigned symbol, unsigned extra) {
  steps_[step_count_++] = {static_cast<std::uint8_t>(symbol), static_cast<std::uint8_t>(extra)};
  ++counts_[symbol];
}

unsigned DynamicBlockHead::code_length_codes() const {
  unsigned count = 19;
  while (count > 4 && codes_[kLengthOrder[count - 1]].length == 0) --count;
  return count;
}

std::uint64_t DynamicBlockHead::bits() const {
  std::uint64_t bits = 3 + 5 + 5 + 4 + 3 * code_length_codes();
  for (unsigned symbol = 0; symbol < 19; ++symbol) {
    const unsigned extra = symbol >= kRepeat ? kExtraBits[symbol - kRepeat] : 0;
    bits += std::uint64_t{counts_[symbol]} * (codes_[symbol].length + extra);
  }
  return bits;
}

void DynamicBlockHead::write(bool last_block, BitWriter& out) const {
  out.put(last_block | 2u << 1, 3);
  out.put(literal_codes_ - 257, 5);
  out.put(distance_codes_ - 1, 5);
  out.put(code_length_codes() - 4, 4);
  out.flush();
  for (unsigned i = 0; i < code_length_codes(); ++i) {
    out.put(codes_[kLengthOrder[i]].length, 3);
    out.flush();
  }
  for (unsigned i = 0; i < step_count_; ++i) {
    const auto [symbol, extra] = steps_[i];
    out.put(codes_[symbol].bits, codes_[symbol].length);
    if (symbol >= kRepeat) out.put(extra, kExtraBits[symbol - kRepeat]);
    out.flush();
  }
}

}  // namespace ccslice
