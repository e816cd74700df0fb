// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sets of numbers that are united two by two. The first number of a set stands for it, so which sets there are doesn't
// depend on the order of unions.

#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace ccslice {

class DisjointSets {
 public:
  /// Each of the numbers 0 to count - 1 by itself.
  explicit DisjointSets(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0u); }

  /// The lowest number of its set.
  std::uint32_t first_of(std::uint32_t number) {
    while (parents_[number] != number) {
      parents_[number] = parents_[parents_[number]];
      number = parents_[number];
    }
    return number;
  }
  bool same(std::uint32_t a, std::uint32_t b) { return first_of(a) == first_of(b); }
  void unite(std::uint32_t a, std::uint32_t b) {
    a = first_of(a), b = first_of(b);
    if (b < a) std::swap(a, b);
    parents_[b] = a;
  }

 private:
  std::vector<std::uint32_t> parents_;
};

}  // namespace ccslice
