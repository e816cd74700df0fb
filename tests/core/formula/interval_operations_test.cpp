// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/interval_operations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace ccslice {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

Interval of(Op op, const Interval& a, const Interval& b = {}, const Interval& c = {}) {
  return on_intervals(op, a, b, c);
}

/// Nearly that, and not less.
void expect_about(const Interval& interval, double low, double high) {
  EXPECT_LE(interval.low, low);
  EXPECT_GE(interval.high, high);
  EXPECT_NEAR(interval.low, low, 1e-12);
  EXPECT_NEAR(interval.high, high, 1e-12);
}

TEST(IntervalOperations, KeepSignsOfSquaresAndPowers) {
  EXPECT_EQ(of(Op::kSquare, {-3, 2}), (Interval{0, 9}));
  EXPECT_EQ(of(Op::kSquare, {-3, -2}), (Interval{4, 9}));
  expect_about(of(Op::kPower, {-3, 2}, {6, 6}), 0, 729);
  expect_about(of(Op::kPower, {1, 4}, {-0.5, 0.5}), 0.5, 2);
  EXPECT_EQ(of(Op::kPower, {0, 4}, {-1, 1}), (Interval{0, kUnbounded}));
}

TEST(IntervalOperations, DivideByIntervalsWithZero) {
  EXPECT_EQ(of(Op::kDivide, {1, 2}, {2, 4}), (Interval{0.25, 1}));
  EXPECT_EQ(of(Op::kDivide, {1, 2}, {0, 4}), (Interval{0, kUnbounded}));
  EXPECT_EQ(of(Op::kDivide, {1, 2}, {-4, 0}), (Interval{-kUnbounded, 0}));
  EXPECT_EQ(of(Op::kDivide, {1, 2}, {-1, 1}), (Interval{-kUnbounded, kUnbounded}));
  EXPECT_EQ(of(Op::kDivide, {1, 2}, {0, 0}), (Interval{0, 0}));
}

TEST(IntervalOperations, FindCrestsOfWaves) {
  expect_about(of(Op::kSine, {0, 1}), 0, std::sin(1));
  expect_about(of(Op::kSine, {1, 2}), std::sin(1), 1);
  expect_about(of(Op::kSine, {3, 5}), -1, std::sin(3));
  expect_about(of(Op::kCosine, {-0.5, 1}), std::cos(1), 1);
  expect_about(of(Op::kCosine, {100, 101}), std::cos(100), 1);
  EXPECT_EQ(of(Op::kSine, {0, 7}), (Interval{-1, 1}));
  EXPECT_EQ(of(Op::kSine, {1e9, 1e9}), (Interval{-1, 1}));
  expect_about(of(Op::kTangent, {-1, 1}), std::tan(-1), std::tan(1));
  EXPECT_EQ(of(Op::kTangent, {1, 2}), (Interval{-kUnbounded, kUnbounded}));
}

TEST(IntervalOperations, FollowAnglesRoundTheAxis) {
  expect_about(of(Op::kAngle, {1, 2}, {1, 2}), std::atan2(1, 2), std::atan2(2, 1));
  expect_about(of(Op::kAngle, {-1, 1}, {1, 2}), -kPi / 4, kPi / 4);
  expect_about(of(Op::kAngle, {-1, 1}, {-2, -1}), -kPi, kPi);
  expect_about(of(Op::kAngle, {0, 1}, {-2, 2}), 0, kPi);
  expect_about(of(Op::kAngle, {0, 1}, {0, 1}), 0, kPi / 2);
}

TEST(IntervalOperations, HoldWhatIsNotDefined) {
  EXPECT_EQ(of(Op::kSquareRoot, {-4, 9}), (Interval{0, 3}));
  EXPECT_EQ(of(Op::kLogarithm, {-4, -1}), (Interval{0, 0}));
  EXPECT_EQ(of(Op::kLogarithm, {0, 1}).low, -745);
  EXPECT_EQ(of(Op::kAdd, {0, kUnbounded}, {-kUnbounded, 0}), (Interval{-kUnbounded, kUnbounded}));
  EXPECT_EQ(of(Op::kMultiply, {0, 1}, {1, kUnbounded}), (Interval{0, kUnbounded}));
}

TEST(IntervalOperations, DecideWhatIsCertain) {
  EXPECT_EQ(of(Op::kLess, {0, 1}, {2, 3}), (Interval{1, 1}));
  EXPECT_EQ(of(Op::kLess, {0, 1}, {1, 3}), (Interval{0, 1}));
  EXPECT_EQ(of(Op::kLess, {1, 2}, {0, 1}), (Interval{0, 0}));
  EXPECT_EQ(of(Op::kEqual, {1, 1}, {1, 1}), (Interval{1, 1}));
  EXPECT_EQ(of(Op::kUnequal, {1, 2}, {3, 4}), (Interval{1, 1}));
  EXPECT_EQ(of(Op::kAnd, {1, 2}, {0, 0}), (Interval{0, 0}));
  EXPECT_EQ(of(Op::kOr, {1, 2}, {0, 1}), (Interval{1, 1}));
  EXPECT_EQ(of(Op::kNot, {-1, 1}), (Interval{0, 1}));
  EXPECT_EQ(of(Op::kIf, {-1, 1}, {0, 1}, {4, 5}), (Interval{0, 5}));
  EXPECT_EQ(of(Op::kIf, {0, 0}, {0, 1}, {4, 5}), (Interval{4, 5}));
  expect_about(of(Op::kSmoothstep, {0, 0}, {2, 2}, {-1, 1}), 0, 0.5);
  EXPECT_EQ(of(Op::kSmoothstep, {0, 1}, {1, 2}, {-1, 3}), (Interval{0, 1}));
}

}  // namespace
}  // namespace ccslice
