// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tables by lists of numbers: by keys of rings, mostly, which are long and often alike for most of their length, so
// that comparing several of them takes longer than this.

#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace ccslice {

using NumberKey = std::vector<std::uint32_t>;

struct NumberKeyHash {
  std::size_t operator()(const NumberKey& key) const noexcept {
    std::uint64_t hash = key.size();
    for (const std::uint32_t number : key) {
      hash = (hash ^ number) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

template <typename Value>
using TableByKey = std::unordered_map<NumberKey, Value, NumberKeyHash>;

}  // namespace ccslice
