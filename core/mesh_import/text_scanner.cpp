// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/text_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace ccslice {
namespace {

/// from_chars refuses numbers too small for a double as well as those too large; the small ones are zero to us.
bool is_tiny(std::string_view token) { return std::abs(std::strtod(std::string(token).c_str(), nullptr)) < 1; }

}  // namespace

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f'; }

std::string_view without_utf8_mark(std::string_view bytes) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  return bytes.starts_with(kMark) ? bytes.substr(kMark.size()) : bytes;
}

std::optional<double> parse_real(std::string_view token) {
  const bool has_plus = token.starts_with('+') && !token.starts_with("+-");
  const std::string_view digits = has_plus ? token.substr(1) : token;
  double value = 0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (end != digits.data() + digits.size() || status == std::errc::invalid_argument) return std::nullopt;
  if (status == std::errc::result_out_of_range) value = is_tiny(digits) ? 0 : HUGE_VAL;
  return value;
}

std::optional<std::uint64_t> parse_count(std::string_view token) {
  std::uint64_t value = 0;
  const auto [end, status] = std::from_chars(token.data(), token.data() + token.size(), value);
  const bool whole = status == std::errc() && end == token.data() + token.size();
  if (!whole || value > (std::uint64_t{1} << 53)) return std::nullopt;
  return value;
}

std::string no_count(std::string_view token) {
  const bool whole = std::ranges::all_of(token, [](char c) { return c >= '0' && c <= '9'; });
  return in_quotes(printable(token)) + (whole ? ", which is beyond 2^53, the largest that is read" : "");
}

std::string in_quotes(std::string_view word) { return std::string(1, '\'').append(word).append(1, '\''); }

std::optional<std::string_view> between_quotes(std::string_view line) {
  const std::size_t open = line.find('"'), close = line.rfind('"');
  if (open == close) return std::nullopt;
  return line.substr(open + 1, close - open - 1);
}

std::string printable(std::string_view token) {
  constexpr std::size_t kLongest = 40;
  std::string shown(token.substr(0, kLongest));
  for (char& c : shown) {
    if (c < 0x20 || c > 0x7e) c = '?';
  }
  return token.size() > kLongest ? shown + "..." : shown;
}

void TextScanner::skip_blank() {
  while (at_ < text_.size()) {
    if (text_[at_] == '#' && comments_ == Comments::kFromHash) {
      at_ = std::min(text_.find('\n', at_), text_.size());
    } else if (is_blank(text_[at_])) {
      line_ += text_[at_++] == '\n';
    } else {
      return;
    }
  }
}

bool TextScanner::at_end() {
  skip_blank();
  return at_ == text_.size();
}

std::string_view TextScanner::peek() {
  skip_blank();
  std::size_t end = at_;
  while (end < text_.size() && !is_blank(text_[end])) ++end;
  token_line_ = line_;
  token_at_ = at_;
  return text_.substr(at_, end - at_);
}

std::string_view TextScanner::next(std::string_view expected) {
  const std::string_view token = peek();
  if (token.empty()) fail(expected, token);
  at_ += token.size();
  token_ = token;
  return token;
}

std::string_view TextScanner::rest_of_line() {
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  std::string_view rest = text_.substr(at_, end - at_);
  token_line_ = line_;
  token_at_ = at_;
  at_ = end;
  if (at_ < text_.size()) {
    ++at_;
    ++line_;
  }
  while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
  return rest;
}

void TextScanner::end_line() {
  const std::string_view rest = rest_of_line();
  if (!std::all_of(rest.begin(), rest.end(), is_blank)) fail("the end of the line", rest);
}

std::string_view TextScanner::bytes(std::uint64_t size, std::string_view expected) {
  token_line_ = line_;
  token_at_ = at_;
  token_ = {};
  if (size > text_.size() - at_) {
    fail_with(ErrorCode::kFileSyntax, "expected " + std::string(expected) + ", found the end of the file");
  }
  const std::string_view block = text_.substr(at_, size);
  at_ += size;
  return block;
}

void TextScanner::skip_paragraph() {
  rest_of_line();
  while (at_ < text_.size() && !rest_of_line().empty()) {
  }
}

double TextScanner::any_real(std::string_view expected) {
  const std::string_view token = next(expected);
  const std::optional<double> value = parse_real(token);
  if (!value) fail(expected, token);
  return *value;
}

double TextScanner::real(std::string_view expected) {
  const double value = any_real(expected);
  if (!std::isfinite(value)) {
    fail_with(ErrorCode::kMeshNonFinite, "'" + printable(token_) + "' is not a finite number");
  }
  return value;
}

float TextScanner::real_float(std::string_view expected) {
  const auto value = static_cast<float>(real(expected));
  if (!std::isfinite(value)) fail_with(ErrorCode::kMeshNonFinite, "the value is too large for a float");
  return value;
}

std::uint64_t TextScanner::count(std::string_view expected) {
  const std::string_view token = next(expected);
  const std::optional<std::uint64_t> value = parse_count(token);
  if (!value) fail_with(ErrorCode::kFileSyntax, "expected " + std::string(expected) + ", found " + no_count(token));
  return *value;
}

std::int64_t TextScanner::integer(std::string_view expected) {
  const std::string_view token = next(expected);
  const bool negative = token.starts_with('-');
  const std::optional<std::uint64_t> size = parse_count(token.substr(negative ? 1 : 0));
  if (!size) fail(expected, token);
  return negative ? -static_cast<std::int64_t>(*size) : static_cast<std::int64_t>(*size);
}

std::uint64_t TextScanner::count_up_to(std::string_view expected, std::uint64_t max) {
  const std::uint64_t value = count(expected);
  if (value > max) {
    fail_with(ErrorCode::kMeshTooLarge, std::string(expected) + " is " + std::to_string(value) + ", at most " +
                                            std::to_string(max) + " are allowed");
  }
  return value;
}

void TextScanner::skip(std::uint64_t tokens, std::string_view expected) {
  for (std::uint64_t i = 0; i < tokens; ++i) next(expected);
}

void TextScanner::fail(std::string_view expected, std::string_view found) const {
  fail_with(ErrorCode::kFileSyntax, "expected " + std::string(expected) + ", found " +
                                        (found.empty() ? "the end of the file" : "'" + printable(found) + "'"));
}

void TextScanner::fail_with(ErrorCode code, const std::string& message, const std::string& field,
                            const std::vector<std::int64_t>& ids) const {
  fail_at(mark(), code, message, field, ids);
}

void TextScanner::fail_at(std::uint64_t mark, ErrorCode code, const std::string& message, const std::string& field,
                          const std::vector<std::int64_t>& ids) const {
  throw Error(code, (names_bytes_ ? "byte " : "line ") + std::to_string(mark) + ": " + message, field, ids);
}

}  // namespace ccslice
