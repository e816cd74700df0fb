// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pairs of boxes that meet, found for all boxes at once: boxes that lie near each other make a block, and of two blocks
// that meet eight boxes are compared at once with each of the other's. That takes a tenth of a microsecond a box, a
// third of what asking a tree for the boxes one by one does.
//
// Private to core/limit.

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/lanes.h"
#include "core/base/types.h"

namespace ccslice {

class BoxBlocks {
 public:
  static constexpr std::size_t kBlockBoxes = 32;
  /// Blocks that a block is compared with: a bound on the time where boxes lie on top of each other.
  static constexpr std::size_t kMostPartners = 1024;

  /// Throws Error{kCancelled}. REQUIRES: fewer than 2^32 boxes.
  BoxBlocks(std::span<const Box3> boxes, const CancellationToken& cancel);

  std::uint32_t size() const { return static_cast<std::uint32_t>(blocks_.size()); }

  /// Calls visit(i, j) for each two boxes that meet, of which the first is of this block and the second of this one or
  /// one after it. So each pair of boxes is visited once over all blocks. False if visit() returned false, which ends
  /// it, or kMostPartners cut it short.
  template <typename Visit>
  [[nodiscard]] bool visit_pairs(std::uint32_t block, Visit visit) const {
    std::size_t partners = 0;
    if (!visit_within(block, block, visit)) return false;
    for (std::uint32_t other = block + 1; other < size() && blocks_[other].min[0] <= blocks_[block].max[0]; ++other) {
      if (!meet(blocks_[block], blocks_[other])) continue;
      if (++partners > kMostPartners || !visit_within(block, other, visit)) return false;
    }
    return true;
  }

 private:
  struct Bounds {
    std::array<float, 3> min, max;
  };
  static constexpr std::size_t kGroups = kBlockBoxes / kFloatLanes;
  /// The boxes of a block, eight at a time. Missing ones meet none.
  struct Group {
    std::array<FloatLanes, 3> min, max;
  };

  Bounds bounds_of(std::size_t i) const {
    const Group& group = groups_[i / kFloatLanes];
    Bounds bounds;
    for (std::size_t a = 0; a < 3; ++a) {
      bounds.min[a] = group.min[a][i % kFloatLanes];
      bounds.max[a] = group.max[a][i % kFloatLanes];
    }
    return bounds;
  }

  static bool meet(const Bounds& a, const Bounds& b) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (a.min[axis] > b.max[axis] || b.min[axis] > a.max[axis]) return false;
    }
    return true;
  }

  template <typename Visit>
  bool visit_within(std::uint32_t block, std::uint32_t other, Visit visit) const {
    for (std::size_t own_group = block * kGroups; own_group < (block + 1) * kGroups; ++own_group) {
      // Most boxes don't meet the other block at all: eight of them are ruled out at once.
      for (unsigned own = meeting(groups_[own_group], blocks_[other]); own != 0; own &= own - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(own));
        if (!visit_box(own_group * kFloatLanes + lane, other, visit)) return false;
      }
    }
    return true;
  }

  /// Visits box i with each box of a block that meets it, and comes after it.
  template <typename Visit>
  bool visit_box(std::size_t i, std::uint32_t block, Visit visit) const {
    const Bounds own = bounds_of(i);
    for (std::size_t first = block * kBlockBoxes; first < (block + 1) * kBlockBoxes; first += kFloatLanes) {
      unsigned left = meeting(groups_[first / kFloatLanes], own);
      if (first <= i) left &= i - first < kFloatLanes ? ~1u << (i - first) : 0;  // Of the same block.
      for (; left != 0; left &= left - 1) {
        if (!visit(order_[i], order_[first + static_cast<std::size_t>(std::countr_zero(left))])) return false;
      }
    }
    return true;
  }

  /// Bit k: the group's k-th box meets the bounds.
  static unsigned meeting(const Group& group, const Bounds& other) noexcept {
    return float_lanes_of((group.min[0] <= other.max[0]) & (group.max[0] >= other.min[0]) &
                          (group.min[1] <= other.max[1]) & (group.max[1] >= other.min[1]) &
                          (group.min[2] <= other.max[2]) & (group.max[2] >= other.min[2]));
  }

  static constexpr std::uint32_t kMissing = ~std::uint32_t{0};

  std::vector<std::uint32_t> order_;  // The boxes, block by block; kMissing at the end of one.
  std::vector<Group> groups_;         // In that order, about the middle of all, rounded outwards.
  std::vector<Bounds> blocks_;        // By where they begin along x.
};

}  // namespace ccslice
