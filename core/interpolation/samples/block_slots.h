// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a block's samples are kept: SLOTS, four to a register.
//
// Nodes are kept in two halves, as the fields of a three-dimensional chessboard: those with even indices (corners and
// middle among them), which a fit is made of, and the odd ones, which check it. Each half takes 64 slots, of which the
// last repeat a node.
//
// Errors of the fifth degree along an axis vanish at five equidistant nodes. Between the outer ones they are largest:
// places there check a fit once more, on the box's edges, and on its faces for errors along two axes. Beside an
// irregular vertex errors may be largest nearer to the ends of edges: there are places, too.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/interpolation/samples/block_nodes.h"
#include "core/subdivision/frame.h"

namespace ccslice {

inline constexpr std::size_t kEvenBlockNodes = 63;  // Slots 0 to 62.
inline constexpr std::size_t kBlockSlots = 128;
inline constexpr std::size_t kBlockGroups = kBlockSlots / kLanes;
/// Places between nodes: near the ends of edges, nearer to them, near the corners of faces. Each kind takes two groups
/// for each axis: that which its edges lie along, or which its faces lie across.
inline constexpr std::size_t kGroupsNearEnds = 6, kGroupsOnEdges = 2 * kGroupsNearEnds,
                             kGroupsBetweenNodes = kGroupsOnEdges + kGroupsNearEnds;
/// Whether a group's places lie between nodes along an axis.
constexpr bool is_between_nodes_along(std::size_t axis, std::size_t group) noexcept {
  return (group / 2 % 3 == axis) == (group < kGroupsOnEdges);
}

/// Where a node is kept: even nodes before slot 64, odd ones from it on.
constexpr std::size_t block_slot(std::size_t node) noexcept { return node / 2 + (node % 2) * (kBlockSlots / 2); }

// Slots after the last node of either half: they repeat it.
inline constexpr std::array<std::size_t, 3> kRepeatingSlots = {kEvenBlockNodes, kBlockSlots - 2, kBlockSlots - 1};
constexpr std::size_t repeated_node(std::size_t slot) {
  return std::tuple_size_v<BlockPoints> - 1 - slot / (kBlockSlots / 2);
}

/// The node that is kept there.
constexpr std::size_t node_of_slot(std::size_t slot) noexcept {
  constexpr std::size_t kHalf = kBlockSlots / 2;
  return std::min(2 * (slot % kHalf) + slot / kHalf, repeated_node(slot));
}

/// One number at every slot.
using BlockValues = std::array<Lanes, kBlockGroups>;

/// Where a block is sampled.
enum class BlockPlaces : std::uint8_t { kNodes, kBetweenNodes };

constexpr std::size_t slots_at(BlockPlaces places) {
  return places == BlockPlaces::kNodes ? kBlockSlots : kGroupsBetweenNodes * kLanes;
}

/// The places' parameters as shares of their box, by axis.
const std::array<BlockValues, 3>& block_shares(BlockPlaces places = BlockPlaces::kNodes);

/// The three numbers at one slot.
inline Vec3 at_slot(const std::array<BlockValues, 3>& values, std::size_t slot) noexcept {
  const std::size_t group = slot / kLanes, lane = slot % kLanes;
  return {values[0][group][lane], values[1][group][lane], values[2][group][lane]};
}

/// For each slot of a cell's block, the slot of the same place where axes are those of the cell's frame.
using SlotsInFrame = std::array<std::uint8_t, kBlockSlots>;
const SlotsInFrame& slots_in_frame(const Frame& frame, BlockPlaces places);

}  // namespace ccslice
