// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Names that users mistype: letters in another case, or a few other ones.

#pragma once

#include <algorithm>
#include <cstddef>
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

/// Letters that have to be inserted, removed, replaced or swapped with the next one to make one word of the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// "; did you mean 'Core'?" if the first name like this one is written with other cases of letters (A to Z). Empty
/// otherwise.
template <typename Named>
std::string hint_of_case(const std::vector<Named>& all, std::string_view name, char quote) {
  const auto found = std::ranges::find_if(all, [&](const Named& it) { return equals_ignoring_case(it.name, name); });
  if (found == all.end()) return "";
  return "; did you mean " + std::string(1, quote) + echoed(found->name) + quote + "?";
}

/// The same of the nearest name, if no more than a third of its letters differ.
template <typename Named>
std::string hint_of_name(const std::vector<Named>& all, std::string_view name, char quote) {
  constexpr std::size_t kLongest = 256, kShare = 3;
  std::string hint = hint_of_case(all, name, quote);
  if (!hint.empty() || name.size() > kLongest) return hint;
  std::size_t least = name.size() / kShare + 1;
  for (const Named& named : all) {
    if (named.name.size() > kLongest) continue;
    const std::size_t letters = edit_distance(named.name, name);
    if (letters >= least) continue;
    least = letters;
    hint = "; did you mean " + std::string(1, quote) + echoed(named.name) + quote + "?";
  }
  return hint;
}

}  // namespace ccslice
