// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/block_slots.h"

#include <gtest/gtest.h>

#include <set>

namespace ccslice {
namespace {

constexpr std::size_t kSlotNodes = std::tuple_size_v<BlockPoints>;

TEST(BlockSlots, KeepEvenAndOddNodesApart) {
  std::set<std::size_t> slots;
  for (std::size_t node = 0; node < kSlotNodes; ++node) {
    slots.insert(block_slot(node));
    EXPECT_EQ(block_slot(node) < kBlockSlots / 2, node % 2 == 0);
  }
  EXPECT_EQ(slots.size(), kSlotNodes);
  EXPECT_EQ(block_slot(kSlotNodes - 1), kEvenBlockNodes - 1);
}

TEST(BlockSlots, KnowThemselvesInEveryFrame) {
  for (const BlockPlaces places : {BlockPlaces::kNodes, BlockPlaces::kBetweenNodes}) {
    const std::array<BlockValues, 3>& shares = block_shares(places);
    for (std::uint8_t corner = 0; corner < 8; ++corner) {
      for (std::uint8_t along = 0; along < 3; ++along) {
        const Frame frame = frame_at(corner, along);
        const SlotsInFrame& slots = slots_in_frame(frame, places);
        for (std::size_t slot = 0; slot < slots_at(places); ++slot) {
          EXPECT_EQ(at_slot(shares, slots[slot]), frame.to_framed(at_slot(shares, slot)));
        }
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
