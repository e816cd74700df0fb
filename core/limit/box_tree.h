// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A bounding volume hierarchy over axis-aligned boxes: which items may hold a point.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice {

class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(std::span<const Box3> boxes);

  std::size_t size() const { return boxes_.size(); }
  const Box3& box(std::uint32_t item) const { return boxes_[item]; }
  std::size_t memory_bytes() const {
    return boxes_.size() * sizeof(Box3) + nodes_.size() * sizeof(Node) + items_.size() * 4;
  }

  /// Calls visit(item) for every item whose box, grown by `margin`, holds the point. No order. Allocation-free.
  template <typename Visit>
  void visit_at(const Vec3& point, double margin, Visit visit) const noexcept {
    if (nodes_.empty()) return;
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!holds(node.box, point, margin)) continue;
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          if (holds(boxes_[items_[i]], point, margin)) visit(items_[i]);
        }
      } else {
        stack[depth++] = node.first;
        stack[depth++] = node.first + 1;
      }
    }
  }

 private:
  struct Node {
    Box3 box;
    std::uint32_t first = 0;  // First item if a leaf, else the first of two children.
    std::uint32_t count = 0;  // Items of a leaf; 0 for inner nodes.
  };
  static bool holds(const Box3& box, const Vec3& p, double margin) noexcept {
    return ((box.min().array() - margin) <= p.array()).all() && (p.array() <= (box.max().array() + margin)).all();
  }
  void split(std::uint32_t node, std::uint32_t first, std::uint32_t count);

  std::vector<Box3> boxes_;
  std::vector<std::uint32_t> items_;
  std::vector<Node> nodes_;
};

}  // namespace ccslice
