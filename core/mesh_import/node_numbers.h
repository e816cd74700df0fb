// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Nodes that a file gives numbers of its own, in any order and with gaps, and that its cells name by them.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace ccslice {

class NodeNumbers {
 public:
  /// The next node has this number. `mark` is its place in the file.
  void add(std::uint64_t number, std::uint64_t mark);
  std::size_t size() const { return nodes_.size(); }

  struct Twin {
    std::uint64_t number, mark;  // The place of the later one.
  };
  /// Before index_of(). Returns a number that two nodes have, if there is one.
  std::optional<Twin> sort();
  /// The numbers, in the order of add().
  std::vector<std::uint64_t> all() const;
  /// Which node that is, counted from 0 in the order of add().
  std::optional<std::uint32_t> index_of(std::uint64_t number) const;

 private:
  struct Node {
    std::uint64_t number, mark;
    std::uint32_t index;
  };
  std::vector<Node> nodes_;
};

}  // namespace ccslice
