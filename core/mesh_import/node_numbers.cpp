// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/node_numbers.h"

#include <algorithm>

namespace ccslice {

void NodeNumbers::add(std::uint64_t number, std::uint64_t mark) {
  nodes_.push_back({number, mark, static_cast<std::uint32_t>(nodes_.size())});
}

std::optional<NodeNumbers::Twin> NodeNumbers::sort() {
  // Files have them in ascending order nearly always, which leaves nothing to do.
  const auto before = [](const Node& a, const Node& b) {
    return a.number != b.number ? a.number < b.number : a.index < b.index;
  };
  if (!std::ranges::is_sorted(nodes_, before)) std::ranges::sort(nodes_, before);
  const auto twin = std::ranges::adjacent_find(nodes_, {}, &Node::number);
  if (twin == nodes_.end()) return std::nullopt;
  return Twin{twin->number, (twin + 1)->mark};
}

std::vector<std::uint64_t> NodeNumbers::all() const {
  std::vector<std::uint64_t> numbers(nodes_.size());
  for (const Node& node : nodes_) numbers[node.index] = node.number;
  return numbers;
}

std::optional<std::uint32_t> NodeNumbers::index_of(std::uint64_t number) const {
  // Most files have them without gaps, which leaves nothing to search.
  const std::uint64_t place = nodes_.empty() ? 0 : number - nodes_.front().number;
  if (place < nodes_.size() && nodes_[place].number == number) return nodes_[place].index;
  const auto found = std::ranges::lower_bound(nodes_, number, {}, &Node::number);
  if (found == nodes_.end() || found->number != number) return std::nullopt;
  return found->index;
}

}  // namespace ccslice
