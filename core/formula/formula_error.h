// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Why a text isn't a formula. Its reader sees the message alone, so it says where the fault is and what to write
// instead.

#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/base/echo.h"

namespace ccslice {

/// The message begins with the column: "column 7: no function is called "gyriod"; did you mean "gyroid"?".
/// A user's text in messages.
inline std::string double_quoted(std::string_view text) { return '"' + echoed(text) + '"'; }

class FormulaError : public std::runtime_error {
 public:
  FormulaError(std::size_t column, const std::string& complaint)
      : std::runtime_error("column " + std::to_string(column) + ": " + complaint), column_(column) {}

  /// Of the first character at fault, in characters of the text; the first one is 1.
  std::size_t column() const noexcept { return column_; }

 private:
  std::size_t column_;
};

}  // namespace ccslice
