// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The names that a message offers: "RAW, PNG or EXR".

#pragma once

#include <cstddef>
#include <string>

namespace ccslice {

/// `rows`: anything with an index and a size, of what has a `name`.
template <typename Rows>
std::string choice_text(const Rows& rows) {
  std::string text;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i > 0) text += i + 1 == rows.size() ? " or " : ", ";
    text += rows[i].name;
  }
  return text;
}

}  // namespace ccslice
