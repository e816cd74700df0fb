// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/block_slots.h"

#include <vector>

namespace ccslice {
namespace {

std::array<BlockValues, 3> shares_at_nodes() {
  std::array<BlockValues, 3> shares{};
  const auto put = [&](std::size_t slot, std::size_t node) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t place = node / kBlockStride[a] % kBlockNodes;
      shares[a][slot / kLanes][slot % kLanes] = static_cast<double>(place) / (kBlockNodes - 1);
    }
  };
  for (const std::size_t slot : kRepeatingSlots) put(slot, repeated_node(slot));
  for (std::size_t node = 0; node < std::tuple_size_v<BlockPoints>; ++node) put(block_slot(node), node);
  return shares;
}

std::array<BlockValues, 3> shares_between_nodes() {
  // x (x - 1/4) (x - 1/2) (x - 3/4) (x - 1) is largest at 0.091.
  constexpr double kNear = 3.0 / 32, kNearer = 1.0 / 32;
  std::array<BlockValues, 3> shares{};
  for (std::size_t slot = 0; slot < kGroupsBetweenNodes * kLanes; ++slot) {
    const std::size_t group = slot / kLanes, axis = group / 2 % 3, bits = slot % (2 * kLanes);
    const double nearest = group >= kGroupsNearEnds && group < kGroupsOnEdges ? kNearer : kNear;
    for (std::size_t a = 0; a < 3; ++a) {
      const bool high = (bits >> ((a + 3 - axis) % 3) & 1) != 0;
      const double near = is_between_nodes_along(a, group) ? nearest : 0;
      shares[a][group][slot % kLanes] = high ? 1 - near : near;
    }
  }
  return shares;
}

// Shares are multiples of a 32nd, numbered along three axes.
constexpr std::size_t kShareSteps = 32;
std::size_t number_of(const Vec3& share) {
  std::size_t number = 0;
  for (const double s : share) number = number * (kShareSteps + 1) + static_cast<std::size_t>(kShareSteps * s);
  return number;
}

std::size_t number_of(const Frame& frame) {
  return (frame.axis[0] * std::size_t{3} + frame.axis[1]) * 8 + frame.origin;
}

/// The slots in each frame, by number_of(frame).
std::vector<SlotsInFrame> slots_in_all_frames(BlockPlaces places) {
  constexpr std::array<std::array<std::uint8_t, 3>, 6> kAxes = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  const std::array<BlockValues, 3>& shares = block_shares(places);
  std::vector<std::uint8_t> slot_of((kShareSteps + 1) * (kShareSteps + 1) * (kShareSteps + 1));
  for (std::size_t slot = slots_at(places); slot-- > 0;) {
    slot_of[number_of(at_slot(shares, slot))] = static_cast<std::uint8_t>(slot);
  }
  std::vector<SlotsInFrame> result(std::size_t{9} * 8);
  for (const auto& axis : kAxes) {
    for (std::uint8_t origin = 0; origin < 8; ++origin) {
      const Frame frame{axis, origin};
      for (std::size_t slot = 0; slot < slots_at(places); ++slot) {
        result[number_of(frame)][slot] = slot_of[number_of(frame.to_framed(at_slot(shares, slot)))];
      }
    }
  }
  return result;
}

}  // namespace

const std::array<BlockValues, 3>& block_shares(BlockPlaces places) {
  static const std::array<BlockValues, 3> kAtNodes = shares_at_nodes(), kBetweenNodes = shares_between_nodes();
  return places == BlockPlaces::kNodes ? kAtNodes : kBetweenNodes;
}

const SlotsInFrame& slots_in_frame(const Frame& frame, BlockPlaces places) {
  static const std::vector<SlotsInFrame> kAtNodes = slots_in_all_frames(BlockPlaces::kNodes),
                                         kBetweenNodes = slots_in_all_frames(BlockPlaces::kBetweenNodes);
  return (places == BlockPlaces::kNodes ? kAtNodes : kBetweenNodes)[number_of(frame)];
}

}  // namespace ccslice
