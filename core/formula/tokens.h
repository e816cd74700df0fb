// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The words of a formula: numbers, names, names in double quotes, and signs.

#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice {

struct Token {
  enum class Kind { kNumber, kName, kQuoted, kSign, kEnd };

  Kind kind = Kind::kEnd;
  std::string text;        // As written; of a name in double quotes what is between them. Empty at the end.
  double number = 0;       // The value of a number.
  std::size_t column = 0;  // Of its first character.

  bool is_sign(std::string_view sign) const { return kind == Kind::kSign && text == sign; }
  bool is_name(std::string_view name) const { return kind == Kind::kName && text == name; }
};

/// The last token is the end. Signs: + - * / ^ ( ) , < <= > >= == != ! && ||. Within double quotes "" is one of them.
/// Throws FormulaError.
std::vector<Token> tokens_of(std::string_view formula);

}  // namespace ccslice
