// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Numbers in messages for people. Files have their own, exact ways.

#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

namespace ccslice {

/// A number as people write it in messages, without trailing zeros, rounded to `significant_digits`.
inline std::string number_text(double value, int significant_digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", significant_digits, value);
  return text;
}

/// The number with as many digits as tell it from every other double: for numbers that are refused, so that one just
/// beyond a limit doesn't look like the limit.
inline std::string number_text(double value) {
  constexpr int kFewestDigits = 10, kEnoughDigits = 17;
  std::string text;
  for (int digits = kFewestDigits; digits <= kEnoughDigits; ++digits) {
    text = number_text(value, digits);
    if (std::strtod(text.c_str(), nullptr) == value) break;
  }
  return text;
}

}  // namespace ccslice
