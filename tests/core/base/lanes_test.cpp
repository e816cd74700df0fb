// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/lanes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace ccslice {
namespace {

TEST(Lanes, AreMultipliedAndAddedWithOneRounding) {
  // (1 + e)^2 - 1 - 2 e is e^2, which a product that is rounded first loses.
  const double e = 0x1p-40, x = 1 + e;
  const Lanes squares = multiply_add(Lanes{x, 2, 3, -x}, Lanes{x, 3, 4, x}, Lanes{-1 - 2 * e, 1, 0, 1 + 2 * e});
  EXPECT_EQ(squares[0], e * e);
  EXPECT_EQ(squares[1], 7);
  EXPECT_EQ(squares[2], 12);
  EXPECT_EQ(squares[3], -e * e);
  EXPECT_EQ(multiply_add(Lanes{x, 0, 0, 0}, x, Lanes{-1 - 2 * e, 5, 0, 0})[0], e * e);
}

TEST(Lanes, AreComparedBitByLane) {
  const Lanes a = {1, 5, -2, 0};
  EXPECT_EQ(lanes_of(a > 0), 0b0011u);
  EXPECT_EQ(lanes_of(a < 0), 0b0100u);
  EXPECT_EQ(lanes_of(a == 0), 0b1000u);
}

TEST(Lanes, AreReadFromAndWrittenToAnyPlace) {
  std::array<double, kLanes + 1> from = {9, 1, 2, 3, 4}, to = {};
  store_unaligned(load_unaligned(from.data() + 1) + Lanes{1, 0, 0, 0}, to.data() + 1);
  EXPECT_EQ(to, (std::array<double, kLanes + 1>{0, 2, 2, 3, 4}));
}

TEST(Lanes, HaveTheLesserAndTheGreaterLaneByLane) {
  const Lanes a = {1, 5, -2, 0}, b = {2, 4, -3, 0};
  EXPECT_EQ(sum(lesser(a, b) * Lanes{1, 10, 100, 1000}), 1 + 40 - 300);
  EXPECT_EQ(sum(greater(a, b) * Lanes{1, 10, 100, 1000}), 2 + 50 - 200);
}

TEST(Lanes, KnowTheirSquareRoots) {
  const Lanes roots = square_root(Lanes{4, 2, 0, 1e-300});
  EXPECT_EQ(roots[0], 2);
  EXPECT_EQ(roots[1], std::sqrt(2.0));
  EXPECT_EQ(roots[2], 0);
  EXPECT_EQ(roots[3], std::sqrt(1e-300));
}

TEST(Lanes, KnowTheirLargestAndTheirSum) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    Lanes a = {-4, -4, -4, -4};
    a[k] = -1;
    EXPECT_EQ(largest(a), -1);
    EXPECT_EQ(sum(a), -13);
  }
  const Lanes up = round_up(Lanes{0.5, -0.5, 2, 1e-300});
  EXPECT_EQ(up[0], 1);
  EXPECT_EQ(up[1], 0);
  EXPECT_EQ(up[2], 2);
  EXPECT_EQ(up[3], 1);
}

}  // namespace
}  // namespace ccslice
