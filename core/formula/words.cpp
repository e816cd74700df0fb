// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/words.h"

#include <algorithm>
#include <array>
#include <vector>

namespace ccslice {

std::span<const FormulaFunction> formula_functions() {
  constexpr std::size_t kAny = 512;
  static const std::vector<FormulaFunction> kFunctions = {
      {"min", 2, kAny, Op::kMinimum},  {"max", 2, kAny, Op::kMaximum},  {"clamp", 3, 3, Op::kClamp},
      {"abs", 1, 1, Op::kAbsolute},    {"floor", 1, 1, Op::kFloor},     {"mod", 2, 2, Op::kModulo},
      {"sqrt", 1, 1, Op::kSquareRoot}, {"exp", 1, 1, Op::kExponential}, {"log", 1, 1, Op::kLogarithm},
      {"sin", 1, 1, Op::kSine},        {"cos", 1, 1, Op::kCosine},      {"tan", 1, 1, Op::kTangent},
      {"atan2", 2, 2, Op::kAngle},     {"if", 3, 3, Op::kIf},           {"smoothstep", 3, 3, Op::kSmoothstep},
      {"gyroid", 3, 3, Op::kGyroid},   {"diamond", 3, 3, Op::kDiamond}, {"schwarz", 3, 3, Op::kSchwarz},
      {"bcc", 3, 3, Op::kBcc},
  };
  return kFunctions;
}

const FormulaFunction* find_function(std::string_view name) {
  const auto functions = formula_functions();
  const auto found = std::ranges::find(functions, name, &FormulaFunction::name);
  return found == functions.end() ? nullptr : &*found;
}

std::span<const std::string> distance_functions() {
  static const std::array<std::string, 2> kFunctions = {"distance", "interface_distance"};
  return kFunctions;
}

bool is_distance_function(std::string_view name) {
  return std::ranges::find(distance_functions(), name) != distance_functions().end();
}

std::span<const std::string> formula_variables() {
  static const std::array<std::string, 6> kVariables = {"x", "y", "z", "r", "theta", "pi"};
  return kVariables;
}

bool is_operator_word(std::string_view name) { return name == "and" || name == "or" || name == "not"; }

}  // namespace ccslice
