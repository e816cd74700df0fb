// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdio>
#include <string>

namespace ccslice {

/// A number as people write it in messages: no trailing zeros.
inline std::string number_text(double value, int significant_digits = 10) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", significant_digits, value);
  return text;
}

}  // namespace ccslice
