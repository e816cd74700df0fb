// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Names that users mistype: letters in another case.

#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/echo.h"

namespace ccslice {

/// Letters A to Z only, for keywords and names.
inline bool equals_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

/// "; did you mean 'Core'?" if the first name like this one is written with other cases of letters (A to Z). Empty
/// otherwise.
template <typename Named>
std::string hint_of_case(const std::vector<Named>& all, std::string_view name, char quote) {
  const auto found = std::ranges::find_if(all, [&](const Named& it) { return equals_ignoring_case(it.name, name); });
  if (found == all.end()) return "";
  return "; did you mean " + std::string(1, quote) + echoed(found->name) + quote + "?";
}

}  // namespace ccslice
