// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A bounding volume hierarchy over axis-aligned boxes: which items may hold a point.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"

namespace ccslice {

class BoxTree {
 public:
  BoxTree() = default;
  /// Throws Error{kCancelled}.
  explicit BoxTree(std::span<const Box3> boxes, const CancellationToken& cancel = {});

  std::size_t size() const { return boxes_.size(); }
  const Box3& box(std::uint32_t item) const { return boxes_[item]; }
  std::size_t memory_bytes() const {
    return boxes_.size() * sizeof(Box3) + nodes_.size() * sizeof(Node) + items_.size() * 4;
  }

  /// Calls visit(item) for every item whose box, grown by `margin`, holds the point. No order. Allocation-free.
  template <typename Visit>
  void visit_at(const Vec3& point, double margin, Visit visit) const noexcept {
    any([&](const Box3& box) { return holds(box, point, margin); },
        [&](std::uint32_t item) { return visit(item), false; });
  }

  /// True if the box of any item, grown by `margin`, holds the point.
  bool any_at(const Vec3& point, double margin) const noexcept {
    return any([&](const Box3& box) { return holds(box, point, margin); }, [](std::uint32_t) { return true; });
  }

  /// True if accept(item) is, for any item whose box meets the given one. Stops there.
  template <typename Accept>
  bool any_meeting(const Box3& other, Accept accept) const noexcept {
    return any([&](const Box3& box) { return box.intersects(other); }, accept);
  }

 private:
  template <typename Meets, typename Accept>
  bool any(Meets meets, Accept accept) const noexcept {
    if (nodes_.empty()) return false;
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!meets(node.box)) continue;
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (meets(boxes_[items_[i]]) && accept(items_[i])) return true;
      }
      if (node.count > 0) continue;
      stack[depth++] = node.first;
      stack[depth++] = node.first + 1;
    }
    return false;
  }

  struct Node {
    Box3 box;
    std::uint32_t first = 0;  // First item if a leaf, else the first of two children.
    std::uint32_t count = 0;  // Items of a leaf; 0 for inner nodes.
  };
  static bool holds(const Box3& box, const Vec3& p, double margin) noexcept {
    return ((box.min().array() - margin) <= p.array()).all() && (p.array() <= (box.max().array() + margin)).all();
  }
  void split(std::uint32_t node, std::uint32_t first, std::uint32_t count, const CancellationToken& cancel);

  std::vector<Box3> boxes_;
  std::vector<std::uint32_t> items_;
  std::vector<Node> nodes_;
};

}  // namespace ccslice
