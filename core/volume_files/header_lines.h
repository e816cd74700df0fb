// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Headers of lines, which volumes' formats have before their samples.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice {

/// Lines of a text, and where they are in it.
class HeaderLines {
 public:
  explicit HeaderLines(std::string_view text) : text_(text) {}

  bool at_end() const { return at_ >= text_.size(); }
  /// The next line without its end and the blanks before that. REQUIRES: !at_end().
  std::string_view next();
  /// The number of the last line, from 1, and the byte behind it.
  std::size_t line() const { return line_; }
  std::size_t offset() const { return at_; }
  /// Throws Error{kFileSyntax}: "line 3: <message>".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view text_;
  std::size_t at_ = 0, line_ = 0;
};

std::string_view trimmed(std::string_view text);
std::string lower_case(std::string_view text);
/// Words between blanks.
std::vector<std::string_view> words_of(std::string_view text);
/// The words as finite numbers, or as whole ones from 0 to 2^32 - 1. Throws Error{kFileSyntax} unless there are `count`
/// of them (0: any number).
std::vector<double> numbers_of(std::string_view text, std::size_t count, const HeaderLines& lines);
std::vector<std::uint32_t> counts_of(std::string_view text, std::size_t count, const HeaderLines& lines);

}  // namespace ccslice
