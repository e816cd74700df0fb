// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A bounding volume hierarchy over axis-aligned boxes: which items may hold a point. Each node has up to four branches,
// whose boxes are compared at once.

#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/lanes.h"
#include "core/base/types.h"

namespace ccslice {

class BoxTree {
 public:
  BoxTree() = default;
  /// Throws Error{kCancelled}. REQUIRES: fewer than 2^29 boxes.
  explicit BoxTree(std::span<const Box3> boxes, const CancellationToken& cancel = {});

  std::size_t size() const { return branches_.size(); }
  Box3 box(std::uint32_t item) const;
  std::size_t memory_bytes() const {
    return nodes_.capacity() * sizeof(Node) + branches_.capacity() * sizeof(std::uint32_t);
  }

  /// Calls visit(item) for every item whose box, grown by `margin`, holds the point. No order. Allocation-free.
  template <typename Visit>
  void visit_at(const Vec3& point, double margin, Visit visit) const noexcept {
    any([&](const Node& node) { return holding(node, point, margin); },
        [&](std::uint32_t item) { return visit(item), false; });
  }

  /// True if the box of any item, grown by `margin`, holds the point.
  bool any_at(const Vec3& point, double margin) const noexcept {
    return any([&](const Node& node) { return holding(node, point, margin); }, [](std::uint32_t) { return true; });
  }

  /// True if accept(item) is, for any item whose box meets the given one. Stops there.
  template <typename Accept>
  bool any_meeting(const Box3& other, Accept accept) const noexcept {
    return any([&](const Node& node) { return meeting(node, other); }, accept);
  }

 private:
  static constexpr std::uint32_t kItem = 1u << 31;  // Marks a child that is an item, not another node.

  struct Node {
    std::array<Lanes, 3> min, max;  // By axis, a lane a branch. Where there is none: NaN, which no test holds for.
    std::array<std::uint32_t, kLanes> branches{};
  };

  template <typename Matching, typename Accept>
  bool any(Matching matching, Accept accept) const noexcept {
    if (nodes_.empty()) return false;
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      for (unsigned left = matching(node); left != 0; left &= left - 1) {
        const std::uint32_t branch = node.branches[static_cast<std::size_t>(std::countr_zero(left))];
        if (!(branch & kItem)) {
          stack[depth++] = branch;
        } else if (accept(branch & ~kItem)) {
          return true;
        }
      }
    }
    return false;
  }

  /// Bit b: branch b's box, grown by `margin`, holds the point.
  static unsigned holding(const Node& node, const Vec3& p, double margin) noexcept {
    return lanes_of((node.min[0] - margin <= p.x()) & (p.x() <= node.max[0] + margin) &
                    (node.min[1] - margin <= p.y()) & (p.y() <= node.max[1] + margin) &
                    (node.min[2] - margin <= p.z()) & (p.z() <= node.max[2] + margin));
  }
  /// Bit b: branch b's box meets the other one.
  static unsigned meeting(const Node& node, const Box3& other) noexcept {
    return lanes_of((node.min[0] <= other.max().x()) & (other.min().x() <= node.max[0]) &
                    (node.min[1] <= other.max().y()) & (other.min().y() <= node.max[1]) &
                    (node.min[2] <= other.max().z()) & (other.min().z() <= node.max[2]));
  }

  class Builder;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> branches_;  // By item: its own, numbered through all nodes.
};

}  // namespace ccslice
