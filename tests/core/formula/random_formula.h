// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Random formulas with another evaluator of theirs: a tree of closures over the C library's functions.

#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace ccslice {

struct FormulaPlace {
  double x, y, z, a, b;  // Coordinates, and channels of these names.
};

struct RandomFormula {
  std::string text;
  /// The value at a place. `nudge`: a factor next to 1 of what elementary functions give, so that values that a
  /// rounding decides about can be told.
  std::function<double(const FormulaPlace&, double nudge)> value;
};

/// Names of the channels that random formulas read.
inline const std::vector<std::string> kRandomChannels = {"a", "b"};

RandomFormula random_formula(std::mt19937_64& random, int depth);

/// Some of them on round numbers, others large or next to 0.
FormulaPlace random_place(std::mt19937_64& random);

}  // namespace ccslice
