// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/packed_stencils.h"

#include <algorithm>
#include <bit>
#include <unordered_map>

namespace ccslice {

PackedStencils::PackedStencils(const Stencils& stencils)
    : row_begin_(stencils.offsets.begin(), stencils.offsets.end()) {
  std::unordered_map<std::uint64_t, std::uint32_t> numbers;  // By bits: zeros of both signs stay what they are.
  std::vector<std::uint32_t> weight_of_entry;
  weight_of_entry.reserve(stencils.weights.size());
  for (const double weight : stencils.weights) {
    const auto next = static_cast<std::uint32_t>(numbers.size());
    weight_of_entry.push_back(numbers.try_emplace(std::bit_cast<std::uint64_t>(weight), next).first->second);
  }
  weights_.resize(numbers.size());
  for (const auto& [bits, number] : numbers) weights_[number] = std::bit_cast<double>(bits);
  constexpr std::size_t kMostShort = std::size_t{1} << 16;
  const bool short_columns = std::ranges::all_of(stencils.indices, [](std::uint32_t i) { return i < kMostShort; });
  if (short_columns && weights_.size() <= kMostShort) {
    pack<std::uint16_t>(stencils, weight_of_entry);
  } else {
    pack<std::uint32_t>(stencils, weight_of_entry);
  }
}

template <typename Number>
void PackedStencils::pack(const Stencils& stencils, const std::vector<std::uint32_t>& weight_of_entry) {
  std::vector<Entry<Number>> entries;
  entries.reserve(stencils.indices.size());
  for (std::size_t e = 0; e < stencils.indices.size(); ++e) {
    entries.push_back({static_cast<Number>(stencils.indices[e]), static_cast<Number>(weight_of_entry[e])});
  }
  entries_ = std::move(entries);
}

std::size_t PackedStencils::memory_bytes() const {
  const auto bytes_of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return bytes_of(row_begin_) + std::visit(bytes_of, entries_) + bytes_of(weights_);
}

}  // namespace ccslice
