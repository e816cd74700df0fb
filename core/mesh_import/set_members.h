// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the readers of sets of cells share.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace ccslice {

/// Counts the members of all sets together: whoever repeats all cells in set after set would take memory and time
/// without end.
class SetMembers {
 public:
  /// `what`: as a message names the sets.
  SetMembers(std::size_t cells, std::string what) : most_(kFew + kMostRepeats * cells), what_(std::move(what)) {}

  void add(std::uint32_t cell, std::vector<std::uint32_t>& cells) {
    count();
    cells.push_back(cell);
  }
  /// Throws Error{kMeshTooLarge} beyond the bound.
  void count() {
    if (++members_ <= most_) return;
    throw Error(ErrorCode::kMeshTooLarge, "the " + what_ + " have more than " + std::to_string(most_) +
                                              " members; leave out those that repeat others");
  }

 private:
  static constexpr std::uint64_t kMostRepeats = 256;  // Of every cell.
  static constexpr std::uint64_t kFew = 1 << 20;
  const std::uint64_t most_;
  const std::string what_;
  std::uint64_t members_ = 0;
};

template <typename Number>
void sort_unique(std::vector<Number>& numbers) {
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace ccslice
