// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/map_text.h"

#include <charconv>

#include "client/cli/base/text_values.h"

namespace ccslice::cli {

std::pair<std::string, std::string> parse_pair(const std::string& taken, const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw UsageError(taken + ", not '" + text + "'");
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::string unquoted(std::string_view text) {
  const bool is_quoted = text.size() > 2 && text.starts_with('"') && text.ends_with('"');
  return std::string(is_quoted ? text.substr(1, text.size() - 2) : text);
}

bool is_number(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

std::pair<std::string, std::string> parse_region(const std::string& taken, const std::string& piece) {
  const bool quoted = piece.starts_with('"');
  const std::size_t equals = quoted ? piece.find("\"=", 1) + 1 : piece.find('=');
  const bool has_name = quoted ? equals > 2 : equals != std::string::npos && equals > 0;
  if (!has_name || equals + 1 == piece.size()) {
    throw UsageError(taken + ", not '" + piece +
                     "'; names with commas or '=' go between quotation marks: 'region:\"a,b\"=...'");
  }
  return {unquoted(std::string_view(piece).substr(0, equals)), piece.substr(equals + 1)};
}

}  // namespace ccslice::cli
