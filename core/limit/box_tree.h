// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A bounding volume hierarchy over axis-aligned boxes: which items may hold a point. Each node has up to four branches,
// whose boxes are compared at once.
//
// In floats it takes half the memory, and its boxes are up to 2^-22 of the tree's extent larger. Every box and every
// question is rounded outwards, so no item is missed.

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/lanes.h"
#include "core/base/types.h"

namespace ccslice {

template <typename Number>
class BasicBoxTree {
 public:
  BasicBoxTree() = default;
  /// Throws Error{kCancelled}. REQUIRES: fewer than 2^29 boxes.
  explicit BasicBoxTree(std::span<const Box3> boxes, const CancellationToken& cancel = {});

  std::size_t size() const { return branches_.size(); }
  /// Holds the one that was given, and is that one in doubles.
  Box3 box(std::uint32_t item) const;
  std::size_t memory_bytes() const {
    return nodes_.capacity() * sizeof(Node) + branches_.capacity() * sizeof(std::uint32_t);
  }

  /// Calls visit(item) for every item whose box, grown by `margin`, holds the point. No order. Allocation-free.
  template <typename Visit>
  void visit_at(const Vec3& point, double margin, Visit visit) const noexcept {
    any_meeting(around(point, margin), [&](std::uint32_t item) { return visit(item), false; });
  }

  /// True if the box of any item, grown by `margin`, holds the point.
  bool any_at(const Vec3& point, double margin) const noexcept {
    return any_meeting(around(point, margin), [](std::uint32_t) { return true; });
  }

  /// True if accept(item) is, for any item whose box meets the given one. Stops there.
  template <typename Accept>
  bool any_meeting(const Box3& other, Accept accept) const noexcept {
    if (nodes_.empty()) return false;
    const Bounds bounds = rounded(other);
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      for (unsigned left = meeting(node, bounds); left != 0; left &= left - 1) {
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

 private:
  static constexpr bool kIsExact = std::is_same_v<Number, double>;
  static constexpr std::uint32_t kItem = 1u << 31;  // Marks a child that is an item, not another node.

  using Four = std::conditional_t<kIsExact, Lanes, HalfLanes>;

  struct Node {
    std::array<Four, 3> min, max;  // By axis, a lane a branch. Where there is none: NaN, which no test holds for.
    std::array<std::uint32_t, kLanes> branches{};
  };

  /// About the origin.
  struct Bounds {
    std::array<Number, 3> min, max;
  };

  static Box3 around(const Vec3& point, double margin) noexcept {
    return {point - Vec3::Constant(margin), point + Vec3::Constant(margin)};
  }

  /// Holds the box.
  Bounds rounded(const Box3& box) const noexcept {
    Bounds bounds;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      bounds.min[a] = rounded<-1>(box.min()[axis] - origin_[axis]);
      bounds.max[a] = rounded<1>(box.max()[axis] - origin_[axis]);
    }
    return bounds;
  }
  template <int kSign>
  Number rounded(double value) const noexcept {
    if constexpr (kIsExact) return value;
    constexpr double kMost = std::numeric_limits<float>::max();
    const auto nearest = static_cast<float>(std::clamp(value, -kMost, kMost));
    return nearest + kSign * (std::numeric_limits<float>::epsilon() * std::abs(nearest) + slack_);
  }

  /// Bit b: branch b's box meets the bounds.
  static unsigned meeting(const Node& node, const Bounds& other) noexcept {
    const auto meet = (node.min[0] <= other.max[0]) & (other.min[0] <= node.max[0]) & (node.min[1] <= other.max[1]) &
                      (other.min[1] <= node.max[1]) & (node.min[2] <= other.max[2]) & (other.min[2] <= node.max[2]);
    if constexpr (kIsExact) {
      return lanes_of(meet);
    } else {
      return half_lanes_of(meet);
    }
  }

  class Builder;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> branches_;  // By item: its own, numbered through all nodes.
  Vec3 origin_ = Vec3::Zero();           // What floats are relative to.
  float slack_ = 0;                      // More than the rounding of doubles where the origin is subtracted or added.
};

using BoxTree = BasicBoxTree<double>;
using FloatBoxTree = BasicBoxTree<float>;

}  // namespace ccslice
