// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/operations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace ccslice {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Lanes in_all_lanes(double value) { return Lanes{} + value; }

TEST(Operations, AreNeverNaN) {
  constexpr double kLargest = std::numeric_limits<double>::max(), kLeast = std::numeric_limits<double>::denorm_min();
  const std::vector<double> hard = {0,  -0.0, 1,        -1,        0.5,    -2.5,      3,         1e9,
                                    -1, 1e20, kLargest, -kLargest, kLeast, kInfinite, -kInfinite};
  for (int op = static_cast<int>(Op::kNegate); op <= static_cast<int>(Op::kBcc); ++op) {
    for (const double a : hard) {
      for (const double b : hard) {
        for (const double c : hard) {
          Lanes result = in_all_lanes(std::numeric_limits<double>::quiet_NaN());
          with_operation(static_cast<Op>(op), [&](const auto& operation) {
            result = operation(in_all_lanes(a), in_all_lanes(b), in_all_lanes(c));
          });
          ASSERT_FALSE(std::isnan(result[0])) << op << " of " << a << ", " << b << ", " << c;
        }
      }
    }
  }
}

TEST(Operations, KeepRemaindersBetweenZeroAndTheDivisor) {
  EXPECT_EQ(modulus(in_all_lanes(7.5), in_all_lanes(2))[0], 1.5);
  EXPECT_EQ(modulus(in_all_lanes(-7.5), in_all_lanes(2))[0], 0.5);
  EXPECT_EQ(modulus(in_all_lanes(7.5), in_all_lanes(-2))[0], -0.5);
  EXPECT_EQ(modulus(in_all_lanes(-1e-300), in_all_lanes(3))[0], 3) << "rounded to the divisor itself";
  EXPECT_EQ(modulus(in_all_lanes(1e300), in_all_lanes(3))[0], 0) << "too many multiples";
  // The quotient is rounded to 3, though it is less.
  const double tenth = 0.1, almost = std::nextafter(3 * 0.1, 0);
  const double rest = modulus(in_all_lanes(almost), in_all_lanes(tenth))[0];
  EXPECT_GE(rest, 0);
  EXPECT_LE(rest, tenth);
}

TEST(Operations, StepSmoothly) {
  EXPECT_EQ(smoothstep(in_all_lanes(1), in_all_lanes(3), in_all_lanes(2))[0], 0.5);
  EXPECT_EQ(smoothstep(in_all_lanes(1), in_all_lanes(3), in_all_lanes(0))[0], 0);
  EXPECT_EQ(smoothstep(in_all_lanes(1), in_all_lanes(3), in_all_lanes(9))[0], 1);
  EXPECT_EQ(smoothstep(in_all_lanes(2), in_all_lanes(2), in_all_lanes(2))[0], 1);
}

}  // namespace
}  // namespace ccslice
