// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/json_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "core/mesh_import/text_scanner.h"

namespace ccslice::cli {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// What may stand in a number, or in a word such as true.
bool is_word(char c) {
  return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '+' || c == '-' || c == '.' ||
         c == '_';
}

/// What JSON asks of a number beyond what std::from_chars does: digits on both sides of a point, no leading zeros.
bool has_json_digits(std::string_view number) {
  number.remove_prefix(number.starts_with('-') ? 1 : 0);
  if (number.empty() || !is_digit(number[0])) return false;
  if (number[0] == '0' && number.size() > 1 && is_digit(number[1])) return false;
  const std::size_t point = number.find('.');
  return point == std::string_view::npos || (point + 1 < number.size() && is_digit(number[point + 1]));
}

void append_utf8(std::uint32_t code, std::string& out) {
  const auto tail = [code](int shift) { return static_cast<char>(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += {static_cast<char>(0xc0 | code >> 6), tail(0)};
  } else if (code < 0x10000) {
    out += {static_cast<char>(0xe0 | code >> 12), tail(6), tail(0)};
  } else {
    out += {static_cast<char>(0xf0 | code >> 18), tail(12), tail(6), tail(0)};
  }
}

}  // namespace

void JsonScanner::skip_blank() {
  while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
}

void JsonScanner::mark() {
  skip_blank();
  mark_ = at_;
}

std::string_view JsonScanner::word() const {
  std::size_t end = at_;
  while (end < text_.size() && is_word(text_[end])) ++end;
  return text_.substr(at_, end - at_);
}

bool JsonScanner::take(char c) {
  mark();
  if (at_ == text_.size() || text_[at_] != c) return false;
  ++at_;
  return true;
}

void JsonScanner::require(char c, std::string_view expected) {
  if (!take(c)) fail(expected);
}

bool JsonScanner::take_null() {
  mark();
  if (word() != "null") return false;
  at_ += word().size();
  return true;
}

bool JsonScanner::at_string() {
  skip_blank();
  return at_ < text_.size() && text_[at_] == '"';
}

void JsonScanner::require_end() {
  mark();
  if (at_ != text_.size()) fail("the end of the file");
}

std::string JsonScanner::string(std::string_view expected) {
  mark();
  if (!at_string()) fail(expected);
  std::string out;
  for (++at_;; ++at_) {
    if (at_ == text_.size()) fail_with(ErrorCode::kFileSyntax, "a string without its closing quotation mark");
    const char c = text_[at_];
    if (c == '"') break;
    if (static_cast<unsigned char>(c) < 0x20) {
      mark_ = at_;
      fail_with(ErrorCode::kFileSyntax, "a control character or the end of a line within a string");
    }
    if (c == '\\') {
      append_escaped(out);
    } else {
      out += c;
    }
  }
  ++at_;
  return out;
}

/// At a backslash; leaves at_ on the last byte of the escape.
void JsonScanner::append_escaped(std::string& out) {
  constexpr std::string_view kLetters = "\"\\/bfnrt", kMeanings = "\"\\/\b\f\n\r\t";
  const char letter = ++at_ < text_.size() ? text_[at_] : '\0';
  if (const std::size_t found = kLetters.find(letter); found != std::string_view::npos) {
    out += kMeanings[found];
    return;
  }
  std::uint32_t code = letter == 'u' ? code_unit() : 0xdc00;
  if (code >= 0xd800 && code < 0xdc00 && text_.substr(at_ + 1, 2) == "\\u") {
    at_ += 2;
    const std::uint32_t low = code_unit();
    code = low >= 0xdc00 && low < 0xe000 ? 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00) : 0xdc00;
  }
  if (code >= 0xd800 && code < 0xe000) fail_with(ErrorCode::kFileSyntax, "a string with an escape that JSON lacks");
  append_utf8(code, out);
}

/// The four digits behind a 'u'; 0xdc00, which stands for nothing alone, if they aren't there.
std::uint32_t JsonScanner::code_unit() {
  constexpr std::size_t kDigits = 4;
  const std::string_view digits = text_.substr(std::min(at_ + 1, text_.size()), kDigits);
  std::uint32_t code = 0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
  if (status != std::errc() || end != digits.data() + kDigits) return 0xdc00;
  at_ += kDigits;
  return code;
}

bool JsonScanner::boolean(std::string_view expected) {
  mark();
  const std::string_view found = word();
  if (found != "true" && found != "false") fail(expected);
  at_ += found.size();
  return found == "true";
}

template <typename Number>
Number JsonScanner::number(std::string_view expected) {
  mark();
  const bool quoted = take('"');
  const std::string_view digits = word();
  at_ += digits.size();
  if (quoted && (digits == "NaN" || digits == "Infinity" || digits == "-Infinity")) {
    fail_with(ErrorCode::kMeshNonFinite, "'" + std::string(digits) + "' is not a finite number");
  }
  Number value = 0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = end == digits.data() + digits.size() && status != std::errc::invalid_argument;
  if (!has_json_digits(digits) || !whole || (quoted && (at_ == text_.size() || text_[at_] != '"'))) fail(expected);
  at_ += quoted;
  if (status != std::errc::result_out_of_range) return value;
  // Too small or too large; the small ones are zero.
  if (std::abs(std::strtod(std::string(digits).c_str(), nullptr)) < 1)
    return digits.front() == '-' ? -Number{0} : Number{0};
  fail_with(ErrorCode::kMeshNonFinite, "'" + printable(digits) + "' is too large a number");
}

double JsonScanner::real(std::string_view expected) { return number<double>(expected); }

float JsonScanner::real_float(std::string_view expected) { return number<float>(expected); }

std::int64_t JsonScanner::integer(std::string_view expected, std::int64_t min, std::int64_t max) {
  const double value = number<double>(expected);
  if (value != std::floor(value) || value < static_cast<double>(min) || value > static_cast<double>(max))
    fail(expected);
  return static_cast<std::int64_t>(value);
}

void JsonScanner::fail(std::string_view expected) const {
  const std::string_view rest = text_.substr(mark_);
  std::size_t length = 0;
  while (length < rest.size() && is_word(rest[length])) ++length;
  if (length == 0 && !rest.empty() && rest[0] == '"') length = rest.find('"', 1) + 1;
  if (length == 0) length = 1;
  fail_with(ErrorCode::kFileSyntax,
            "expected " + std::string(expected) + ", found " +
                (rest.empty() ? "the end of the file" : "'" + printable(rest.substr(0, length)) + "'"));
}

void JsonScanner::fail_with(ErrorCode code, const std::string& message) const {
  const std::string_view before = text_.substr(0, mark_);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t column = mark_ - (before.find_last_of('\n') + 1) + 1;  // npos + 1 is 0.
  throw Error(code, "line " + std::to_string(line) + ", column " + std::to_string(column) + ": " + message);
}

}  // namespace ccslice::cli
