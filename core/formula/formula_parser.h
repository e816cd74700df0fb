// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From a text to a program, by recursive descent. From what binds least to what binds most:
//
//   or ||    and &&    not    < <= > >= == !=    + -    * /    unary - + !    ^ (from right to left)

#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/formula/program.h"

namespace ccslice {

/// How far a point is from a surface of the part, mm.
struct FormulaDistance {
  bool from_interfaces = false;  // From where cell regions meet, and not from the boundary.
  double reach_mm = 0;           // That of points that are farther.

  bool operator==(const FormulaDistance&) const = default;
};

struct ParsedFormula {
  Program program;
  std::vector<std::string> inputs;         // Channels that it reads, in the order of first use.
  std::vector<FormulaDistance> distances;  // That it reads: inputs of the program behind the channels.
  bool uses_place = false;                 // Whether it reads coordinates.
};

/// `channels`: names that the formula may read. Throws FormulaError.
ParsedFormula parse_formula(std::string_view text, std::span<const std::string> channels);

}  // namespace ccslice
