// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tokens separated by white space, with line numbers: what the mesh file readers share. Files are hostile until proved
// otherwise, so a scanner never trusts a count: numbers are handed out one by one as their tokens arrive, and every
// failure names the line, what was expected there and the token found instead. Where blocks of bytes stand between the
// lines of text, failures name the byte offset (from 0) instead of the line.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

class TextScanner {
 public:
  /// Whether a '#' at the start of a token opens a comment up to the end of the line.
  enum class Comments { kFromHash, kNone };

  /// `text` must outlive the scanner.
  explicit TextScanner(std::string_view text, Comments comments = Comments::kFromHash)
      : text_(text), comments_(comments) {}

  /// Line (from 1) of the token read last.
  std::size_t line() const noexcept { return token_line_; }
  /// The token taken last; empty after a block of bytes.
  std::string_view token() const noexcept { return token_; }
  /// True when only white space and comments are left.
  bool at_end();
  /// The next token without taking it; empty at the end.
  std::string_view peek();
  /// Takes the next token. `expected` names it for the error thrown at the end of the file.
  std::string_view next(std::string_view expected);
  /// Takes what is left of the current line, its end included. Comments are not recognized here.
  std::string_view rest_of_line();
  /// Takes the end of the current line, which must be empty up to there.
  void end_line();
  /// Takes the next `size` bytes as they are.
  std::string_view bytes(std::uint64_t size, std::string_view expected);
  /// The text begins with this line of its file, which failures name.
  void start_at_line(std::size_t line) noexcept { line_ = token_line_ = line; }
  /// From now on failures name byte offsets; that of the text's beginning is `first`.
  void name_byte_offsets(std::uint64_t first = 0) noexcept {
    names_bytes_ = true;
    first_byte_ = first;
  }
  /// From now on failures name this byte: for text that stands in the file in another form.
  void name_one_byte(std::uint64_t byte) noexcept {
    name_byte_offsets(byte);
    one_byte_ = true;
  }
  /// Takes the rest of the current line, then lines up to the next empty one (or the end of the file).
  void skip_paragraph();

  /// A real, which may be nan or inf. Throws kFileSyntax.
  double any_real(std::string_view expected);
  /// A finite real. Throws kFileSyntax, or kMeshNonFinite for nan and inf.
  double real(std::string_view expected);
  /// A finite real that fits a float: kMeshNonFinite otherwise.
  float real_float(std::string_view expected);
  /// An integer in [0, 2^53].
  std::uint64_t count(std::string_view expected);
  /// An integer in [-2^53, 2^53].
  std::int64_t integer(std::string_view expected);
  /// A count that must not be larger than `max`: kMeshTooLarge otherwise.
  std::uint64_t count_up_to(std::string_view expected, std::uint64_t max);
  /// Passes over `tokens` tokens; each must be there.
  void skip(std::uint64_t tokens, std::string_view expected);

  /// "line 12: expected a coordinate, found 'foo'", or "byte 512: ...".
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const;
  /// "line 12: <message>", or "byte 512: <message>", with the field and the ids of Error.
  [[noreturn]] void fail_with(ErrorCode code, const std::string& message, const std::string& field = {},
                              const std::vector<std::int64_t>& ids = {}) const;
  /// Where the token read last is, for failures that show later.
  std::uint64_t mark() const noexcept {
    if (!names_bytes_) return token_line_;
    return one_byte_ ? first_byte_ : first_byte_ + token_at_;
  }
  /// As fail_with(), at a mark.
  [[noreturn]] void fail_at(std::uint64_t mark, ErrorCode code, const std::string& message,
                            const std::string& field = {}, const std::vector<std::int64_t>& ids = {}) const;

 private:
  void skip_blank();

  std::string_view text_;
  Comments comments_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  std::size_t token_line_ = 1;
  std::size_t token_at_ = 0;
  std::string_view token_;
  bool names_bytes_ = false, one_byte_ = false;
  std::uint64_t first_byte_ = 0;
};

/// The number that a token is: a real, which may be nan or inf, or an integer in [0, 2^53].
std::optional<double> parse_real(std::string_view token);
std::optional<std::uint64_t> parse_count(std::string_view token);

/// What a message says of a token that isn't such an integer: "'12x'", or that it is too large.
std::string no_count(std::string_view token);

/// The text behind a byte order mark, which some programs put before UTF-8.
std::string_view without_utf8_mark(std::string_view bytes);

/// Whitespace between tokens, ends of lines too.
bool is_blank(char c);

/// "'Faces'", for "expected 'Faces'".
std::string in_quotes(std::string_view word);

/// What stands between the first and the last quotation mark of the line. Nothing without two of them.
std::optional<std::string_view> between_quotes(std::string_view line);

/// A token fit for a message: cut to 40 bytes, unprintable bytes replaced by '?'.
std::string printable(std::string_view token);

}  // namespace ccslice
