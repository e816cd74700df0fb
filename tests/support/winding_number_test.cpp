// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/winding_number.h"

#include <gtest/gtest.h>

#include <numbers>

namespace ccslice::oracle {
namespace {

const Polygon kSquare = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};

TEST(WindingNumber, CountsTurnsWithTheirSign) {
  const Polygon clockwise = {{1, 1}, {1, 3}, {3, 3}, {3, 1}};
  const std::vector<Polygon> with_hole = {kSquare, clockwise};
  EXPECT_EQ(winding_number(with_hole, {0.5, 2}), 1);
  EXPECT_EQ(winding_number(with_hole, {2, 2}), 0);
  EXPECT_EQ(winding_number(with_hole, {5, 2}), 0);
  const std::vector<Polygon> twice = {kSquare, kSquare};
  EXPECT_EQ(winding_number(twice, {1, 1}), 2);
}

TEST(WindingNumber, GivesPentagramsTheirCentre) {
  Polygon star;
  for (int i = 0; i < 5; ++i) {
    const double a = 4 * std::numbers::pi * i / 5;
    star.push_back({std::cos(a), std::sin(a)});
  }
  EXPECT_EQ(winding_number(std::vector<Polygon>{star}, {0, 0}), 2);
  EXPECT_EQ(winding_number(std::vector<Polygon>{star}, {0.8, 0}), 1);
}

TEST(WindingNumber, MeasuresDistanceToEdgesAndCorners) {
  EXPECT_DOUBLE_EQ(distance_to(std::vector<Polygon>{kSquare}, {1, 2}), 1);
  EXPECT_DOUBLE_EQ(distance_to(std::vector<Polygon>{kSquare}, {7, 8}), 5);
}

}  // namespace
}  // namespace ccslice::oracle
