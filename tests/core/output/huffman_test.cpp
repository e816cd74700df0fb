// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/huffman.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <queue>
#include <random>
#include <vector>

namespace ccslice {
namespace {

using Counts = std::vector<std::uint32_t>;

std::vector<HuffmanCode> codes_of(const Counts& counts, unsigned max_length) {
  std::vector<HuffmanCode> codes(counts.size());
  make_huffman_codes(counts, max_length, codes);
  return codes;
}

double kraft_sum(const std::vector<HuffmanCode>& codes) {
  double sum = 0;
  for (const HuffmanCode& code : codes) sum += code.length > 0 ? 1.0 / (1 << code.length) : 0;
  return sum;
}

std::uint64_t cost(const Counts& counts, const std::vector<HuffmanCode>& codes) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) bits += std::uint64_t{counts[i]} * codes[i].length;
  return bits;
}

/// By the textbook: the sum of all inner nodes' weights.
std::uint64_t optimal_cost(const Counts& counts) {
  std::priority_queue<std::uint64_t, std::vector<std::uint64_t>, std::greater<>> nodes;
  for (const std::uint32_t count : counts) {
    if (count > 0) nodes.push(count);
  }
  std::uint64_t bits = 0;
  while (nodes.size() > 1) {
    std::uint64_t sum = nodes.top();
    nodes.pop();
    sum += nodes.top();
    nodes.pop();
    nodes.push(sum);
    bits += sum;
  }
  return bits;
}

TEST(HuffmanCodes, AreCompleteAndOptimal) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 300; ++trial) {
    Counts counts(2 + random() % 287);
    for (std::uint32_t& count : counts) count = random() % 3 ? random() % (1u << random() % 12) : 0;
    counts[0] = counts[1] = 1;
    const auto codes = codes_of(counts, 15);
    EXPECT_EQ(kraft_sum(codes), 1);
    EXPECT_EQ(cost(counts, codes), optimal_cost(counts));
    for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_EQ(codes[i].length > 0, counts[i] > 0);
  }
}

TEST(HuffmanCodes, KeepWithinTheirLongest) {
  Counts fibonacci = {1, 1};
  while (fibonacci.size() < 40) fibonacci.push_back(fibonacci[fibonacci.size() - 1] + fibonacci[fibonacci.size() - 2]);
  for (const unsigned longest : {6u, 7u, 10u, 15u}) {
    const auto codes = codes_of(fibonacci, longest);
    EXPECT_EQ(kraft_sum(codes), 1);
    for (const HuffmanCode& code : codes) EXPECT_LE(code.length, longest);
  }
  EXPECT_EQ(kraft_sum(codes_of(Counts(19, 5), 7)), 1);
}

TEST(HuffmanCodes, HaveNoPrefixInCommon) {
  const auto codes = codes_of({5, 9, 12, 13, 16, 45, 0, 1}, 15);
  for (const HuffmanCode& a : codes) {
    for (const HuffmanCode& b : codes) {
      if (&a == &b || a.length == 0 || b.length < a.length) continue;
      EXPECT_NE(a.bits, b.bits & ((1u << a.length) - 1));  // Bits are reversed: the first one is the lowest.
    }
  }
}

TEST(HuffmanCodes, AreCompleteForOneSymbolAndForNone) {
  for (const Counts& counts : {Counts{0, 0, 0}, Counts{7, 0, 0}, Counts{0, 0, 7}}) {
    EXPECT_EQ(kraft_sum(codes_of(counts, 15)), 1);
  }
}

}  // namespace
}  // namespace ccslice
