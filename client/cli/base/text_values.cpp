// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/text_values.h"

#include <charconv>
#include <cmath>
#include <optional>

namespace ccslice::cli {
namespace {

template <typename Number>
std::optional<Number> whole_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  Number number{};
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = !text.empty() && status == std::errc() && end == text.data() + text.size();
  return whole ? std::optional(number) : std::nullopt;
}

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

}  // namespace

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at != std::string_view::npos;) {
    const std::size_t end = text.find(separator, at);
    parts.emplace_back(text.substr(at, end - at));
    at = end == std::string_view::npos ? end : end + 1;
  }
  return parts;
}

double parse_number(const std::string& option, std::string_view text) {
  const std::optional<double> number = whole_number<double>(text);
  if (!number || !std::isfinite(*number)) throw UsageError(option + " takes a number, not " + quoted(text));
  return *number;
}

std::vector<double> parse_numbers(const std::string& option, std::string_view text, std::size_t least,
                                  std::size_t most) {
  std::vector<double> numbers;
  for (const std::string& part : split(text, ',')) numbers.push_back(parse_number(option, part));
  if (numbers.size() < least || numbers.size() > most) {
    const std::string wanted =
        least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most);
    throw UsageError(option + " takes " + wanted + " numbers separated by commas, not " + quoted(text));
  }
  return numbers;
}

LayerRange parse_layer_range(const std::string& option, std::string_view text) {
  const std::size_t dots = text.find("..");
  const auto first = whole_number<std::uint32_t>(text.substr(0, dots));
  const auto last = dots == std::string_view::npos ? first : whole_number<std::uint32_t>(text.substr(dots + 2));
  if (!first || !last || *last < *first) {
    throw UsageError(option + " takes a layer, as in 10, or the first and the last one, as in 10..19, not " +
                     quoted(text));
  }
  return {*first, *last};
}

Share parse_share(const std::string& option, std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto number = whole_number<std::uint32_t>(text.substr(0, slash));
  const auto count =
      slash == std::string_view::npos ? std::nullopt : whole_number<std::uint32_t>(text.substr(slash + 1));
  if (!number || !count || *count == 0) {
    throw UsageError(option + " takes I/N, share I of N, as in 2/8, not " + quoted(text));
  }
  if (*number == 0 || *number > *count) {
    throw UsageError(option + " " + quoted(text) + ": the shares are numbered from 1 to " + std::to_string(*count));
  }
  return {*number, *count};
}

std::vector<std::uint32_t> parse_counts(const std::string& option, std::string_view text, const std::string& names) {
  std::vector<std::uint32_t> counts;
  const std::vector<std::string> parts = split(text, ',');
  for (const std::string& part : parts) {
    const auto count = whole_number<std::uint32_t>(part);
    if (count) counts.push_back(*count);
  }
  if (counts.size() != parts.size() || counts.size() != split(names, ',').size()) {
    throw UsageError(option + " takes whole numbers, " + names + ", not " + quoted(text));
  }
  return counts;
}

}  // namespace ccslice::cli
