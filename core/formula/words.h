// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The words that formulas know beside the names of channels: docs/fields.md lists them.

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "core/formula/program.h"

namespace ccslice {

struct FormulaFunction {
  std::string name;
  std::size_t least, most;  // Values that it takes.
  Op op;                    // For more than two values: of the first two, then of that and the third one, and so on.
};

/// Ordered as the reference has them.
std::span<const FormulaFunction> formula_functions();

/// nullptr if there is none of that name.
const FormulaFunction* find_function(std::string_view name);

/// From the boundary, and from where cell regions meet. They take a number.
std::span<const std::string> distance_functions();
bool is_distance_function(std::string_view name);

/// x y z r theta pi.
std::span<const std::string> formula_variables();

/// and, or, not.
bool is_operator_word(std::string_view name);

}  // namespace ccslice
