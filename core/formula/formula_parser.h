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

struct ParsedFormula {
  Program program;
  std::vector<std::string> inputs;  // Channels that it reads, in the order of first use.
  bool uses_place = false;          // Whether it reads coordinates.
};

/// `channels`: names that the formula may read. Throws FormulaError.
ParsedFormula parse_formula(std::string_view text, std::span<const std::string> channels);

}  // namespace ccslice
