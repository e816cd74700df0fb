// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Keys -> 0, 1, 2, ... in the order of their first insertion: an open-addressing table whose answers depend on that
// order only, never on hashes or addresses, and that keeps its memory when cleared.

#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/limit/boundary_surface.h"

namespace ccslice {

/// REQUIRES: Key equality-comparable, with std::uint64_t hash_of(const Key&) beside it.
template <class Key>
class IdTable {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  void clear() {
    keys_.clear();
    std::fill(slots_.begin(), slots_.end(), 0);
  }

  /// Makes room for so many keys.
  void reserve(std::size_t count) {
    keys_.reserve(count);
    while (slots_.size() < 2 * count) grow();
  }

  std::size_t size() const { return keys_.size(); }
  const Key& key(std::uint32_t id) const { return keys_[id]; }

  /// The key's id, and whether it is new.
  std::pair<std::uint32_t, bool> insert(const Key& key) {
    if (2 * (keys_.size() + 1) > slots_.size()) grow();
    std::uint32_t& slot = slots_[slot_of(key)];
    if (slot != 0) return {slot - 1, false};
    keys_.push_back(key);
    slot = static_cast<std::uint32_t>(keys_.size());
    return {slot - 1, true};
  }

  std::uint32_t find(const Key& key) const { return slots_.empty() ? kNone : slots_[slot_of(key)] - 1; }

 private:
  /// The slot that holds the key, or the empty one where it belongs. Slots hold id + 1.
  std::size_t slot_of(const Key& key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = hash_of(key) & mask;
    while (slots_[at] != 0 && !(keys_[slots_[at] - 1] == key)) at = (at + 1) & mask;
    return at;
  }

  void grow() {
    slots_.assign(std::max<std::size_t>(64, 2 * slots_.size()), 0);
    for (std::size_t id = 0; id < keys_.size(); ++id) slots_[slot_of(keys_[id])] = static_cast<std::uint32_t>(id + 1);
  }

  std::vector<Key> keys_;
  std::vector<std::uint32_t> slots_;  // A power of two, at most half full.
};

constexpr std::uint64_t mix_bits(std::uint64_t word) {
  word ^= word >> 32;
  word *= 0xd6e8feb86659fd93ull;
  word ^= word >> 32;
  word *= 0xd6e8feb86659fd93ull;
  return word ^ word >> 32;
}

inline std::uint64_t hash_of(const SurfaceKey& key) {
  const std::uint64_t place = std::uint64_t{key.s} << 32 | key.t;
  const std::uint64_t root = std::uint64_t{static_cast<std::uint32_t>(key.kind)} << 32 | key.id;
  return mix_bits(place + std::rotl(mix_bits(root), 17));
}

/// Two vertices, the smaller id first: an undirected edge.
struct VertexPair {
  std::uint32_t a = 0, b = 0;
  friend bool operator==(const VertexPair&, const VertexPair&) = default;
};

inline std::uint64_t hash_of(const VertexPair& pair) { return mix_bits(std::uint64_t{pair.a} << 32 | pair.b); }

}  // namespace ccslice
