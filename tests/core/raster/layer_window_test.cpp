// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/layer_window.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/raster/occupancy.h"

namespace ccslice {
namespace {

constexpr LayerWindow kWindow{3, 2, 4, 3};

bool holds(std::uint32_t column, std::uint32_t row) { return column >= 3 && column < 7 && row >= 2 && row < 5; }

TEST(LayerWindow, NumbersItsVoxelsByRow) {
  std::size_t next = 0;
  for (std::uint32_t row = 0; row < 8; ++row) {
    for (std::uint32_t column = 0; column < 10; ++column) {
      if (holds(column, row)) {
        EXPECT_EQ(kWindow.index(column, row), next++);
      }
    }
  }
  EXPECT_EQ(next, 12u);
  EXPECT_EQ(kWindow.end_column(), 7u);
  EXPECT_EQ(kWindow.end_row(), 5u);
}

TEST(LayerWindow, ClipsEverySpanToWhatItHolds) {
  for (std::uint32_t row = 0; row < 8; ++row) {
    for (std::uint32_t begin = 0; begin < 10; ++begin) {
      for (std::uint32_t end = begin; end < 11; ++end) {
        const VoxelRun part = kWindow.clipped({row, begin, end});
        EXPECT_EQ(part.row, row);
        ASSERT_LE(part.begin, part.end);
        for (std::uint32_t column = 0; column < 11; ++column) {
          const bool expected = column >= begin && column < end && holds(column, row);
          EXPECT_EQ(column >= part.begin && column < part.end, expected) << row << ' ' << begin << ' ' << end;
        }
      }
    }
  }
}

TEST(LayerWindow, OfALatticeIsAllOfIt) {
  EXPECT_EQ(window_of(LayerLattice{1, 2, 0.5, 0.5, 8, 9}), (LayerWindow{0, 0, 8, 9}));
}

TEST(LayerWindow, HasInCommonWhatBothHold) {
  EXPECT_EQ(common_window(kWindow, {5, 0, 9, 4}), (LayerWindow{5, 2, 2, 2}));
  EXPECT_EQ(common_window(kWindow, kWindow), kWindow);
  EXPECT_EQ(common_window(kWindow, {7, 2, 4, 3}).columns, 0u) << "they touch";
  EXPECT_EQ(common_window({20, 20, 1, 1}, kWindow).rows, 0u);
}

TEST(LayerWindow, OfSpansHoldsAllOfThem) {
  const std::vector<VoxelRun> spans = {{4, 7, 9}, {4, 12, 13}, {6, 3, 5}};
  EXPECT_EQ(window_of(spans), (LayerWindow{3, 4, 10, 3}));
  EXPECT_EQ(window_of(std::vector<VoxelRun>()), LayerWindow());
}

}  // namespace
}  // namespace ccslice
