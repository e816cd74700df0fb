// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/header_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/error.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

void require_count(std::size_t found, std::size_t count, const HeaderLines& lines) {
  if (count == 0 ? found > 0 : found == count) return;
  const std::string expected = count == 0 ? "numbers" : std::to_string(count) + (count == 1 ? " number" : " numbers");
  lines.fail("expected " + expected + ", found " + std::to_string(found));
}

}  // namespace

std::string_view HeaderLines::next() {
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  const std::string_view line = text_.substr(at_, end - at_);
  at_ = std::min(end + 1, text_.size());
  ++line_;
  return line.substr(0, line.find_last_not_of(" \t\r") + 1);
}

void HeaderLines::fail(const std::string& message) const {
  throw Error(ErrorCode::kFileSyntax, "line " + std::to_string(line_) + ": " + message);
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return lower;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::string_view rest = trimmed(text); !rest.empty(); rest = trimmed(rest)) {
    words.push_back(rest.substr(0, rest.find_first_of(" \t\r")));
    rest.remove_prefix(words.back().size());
  }
  return words;
}

std::vector<double> numbers_of(std::string_view text, std::size_t count, const HeaderLines& lines) {
  std::vector<double> numbers;
  for (const std::string_view word : words_of(text)) {
    const std::optional<double> number = parse_real(word);
    if (!number || !std::isfinite(*number)) lines.fail("expected a number, found " + in_quotes(printable(word)));
    numbers.push_back(*number);
  }
  require_count(numbers.size(), count, lines);
  return numbers;
}

std::vector<std::uint32_t> counts_of(std::string_view text, std::size_t count, const HeaderLines& lines) {
  std::vector<std::uint32_t> counts;
  for (const std::string_view word : words_of(text)) {
    const std::optional<std::uint64_t> number = parse_count(word);
    if (!number || *number > std::numeric_limits<std::uint32_t>::max()) {
      lines.fail("expected a whole number up to 4294967295, found " + in_quotes(printable(word)));
    }
    counts.push_back(static_cast<std::uint32_t>(*number));
  }
  require_count(counts.size(), count, lines);
  return counts;
}

}  // namespace ccslice
