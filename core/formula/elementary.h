// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Elementary functions of four doubles at once. Those of C libraries differ from version to version in the last place;
// these are made of + - * / and fused multiply-add alone, so that every machine gets the same bytes. There are neither
// tables nor branches.
//
//   exp, log   argument = k log 2 + rest, and a polynomial of the rest [Muller16, 11.1]
//   sin, cos   argument = k pi/2 + rest, with pi/2 in three doubles [Muller16, 11.2: Cody and Waite]
//   log        log m = 2 atanh((m - 1) / (m + 1)), in pairs of doubles: power() needs more than 53 bits
//   atan2      the lesser coordinate over the greater one, and atan t = pi/4 + atan((t - 1) / (t + 1))
//
// Polynomials are minimax ones (Remez's algorithm in 240 bits). [Muller16] is J.-M. Muller, *Elementary Functions:
// Algorithms and Implementation*, 3rd edition, 2016.
//
// Errors are in units in the last place of the exact value. `elementary_test.cpp` measures them.
//
// REQUIRES of all: no lane is NaN. No result is.

#pragma once

#include "core/base/lanes.h"

namespace ccslice {

/// Beyond it an angle counts as 0: neighbouring numbers that are made of floats tell no direction there.
inline constexpr double kLargestAngle = 0x1p40;  // Radians, or turns.

struct SineCosine {
  Lanes sine, cosine;
};

/// `angle`: radians. Error up to kLargestAngle: below 1. Within [-1, 1].
SineCosine sine_cosine(Lanes angle) noexcept;
/// `turns`: of 360 degrees, so that the period is 1 exactly. Error: below 1. Within [-1, 1].
SineCosine sine_cosine_of_turns(Lanes turns) noexcept;
/// Error up to kLargestAngle: below 1.5. Finite.
Lanes tangent(Lanes angle) noexcept;

/// Error: below 1.
Lanes exponential(Lanes x) noexcept;
/// Natural. Error: below 1. 0 where it isn't defined: of 0 and of what is negative.
Lanes logarithm(Lanes x) noexcept;
/// Error: below 1.5. 1 where the exponent is 0. A negative base needs an integer as exponent. 0 where it isn't defined:
/// of other negative bases, and of 0 to what is negative.
Lanes power(Lanes base, Lanes exponent) noexcept;

/// The angle of (x, y) from the x axis, radians within [-pi, pi]. Error: below 1. 0 of (0, 0); the signs of zeros don't
/// count, so that it is pi all along the negative x axis.
Lanes angle_of(Lanes y, Lanes x) noexcept;

}  // namespace ccslice
