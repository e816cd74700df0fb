// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// JSON (RFC 8259) value by value, as a reader that knows its schema asks for them. Every failure names line and column,
// what was expected there and what was found instead.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/error.h"

namespace ccslice::cli {

class JsonScanner {
 public:
  /// `text` must outlive the scanner.
  explicit JsonScanner(std::string_view text) : text_(text) {}

  /// Takes `c` if it comes next, white space aside.
  [[nodiscard]] bool take(char c);
  /// Takes `c`, which must come next.
  void require(char c, std::string_view expected);
  /// Takes `null` if it comes next.
  [[nodiscard]] bool take_null();
  /// Whether a string comes next.
  bool at_string();
  void require_end();

  std::string string(std::string_view expected);
  bool boolean(std::string_view expected);
  /// Finite, in quotation marks or not, as protobuf has it. Throws kMeshNonFinite for NaN, Infinity and what a double
  /// or a float can't hold; tiny numbers become zero.
  double real(std::string_view expected);
  float real_float(std::string_view expected);
  /// A whole number within [min, max], however it is written: 12, 12.0, 1.2e1.
  std::int64_t integer(std::string_view expected, std::int64_t min, std::int64_t max);

  /// "line 3, column 7: expected a coordinate, found 'three'", of the value that was asked for last.
  [[noreturn]] void fail(std::string_view expected) const;
  /// "line 3, column 7: <message>".
  [[noreturn]] void fail_with(ErrorCode code, const std::string& message) const;

 private:
  void skip_blank();
  void mark();
  std::string_view word() const;
  template <typename Number>
  Number number(std::string_view expected);
  void append_escaped(std::string& out);
  std::uint32_t code_unit();

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t mark_ = 0;  // Where the value starts that was asked for last.
};

/// Calls `item` for each member of an array.
template <typename Item>
void for_each_item(JsonScanner& scanner, Item&& item) {
  scanner.require('[', "'['");
  if (scanner.take(']')) return;
  do {
    item();
  } while (scanner.take(','));
  scanner.require(']', "',' or ']'");
}

}  // namespace ccslice::cli
