// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/option_values.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace ccslice::server {
namespace {

using Unit = std::pair<std::string_view, std::uint64_t>;

constexpr std::array<Unit, 8> kSizeUnits = {{{"", 1},
                                             {"B", 1},
                                             {"K", 1ull << 10},
                                             {"KiB", 1ull << 10},
                                             {"M", 1ull << 20},
                                             {"MiB", 1ull << 20},
                                             {"G", 1ull << 30},
                                             {"GiB", 1ull << 30}}};
constexpr std::array<Unit, 4> kTimeUnits = {{{"ms", 1}, {"s", 1000}, {"m", 60'000}, {"h", 3'600'000}}};

/// Digits at the start of `text`, which keeps the rest.
std::optional<std::uint64_t> take_number(std::string_view& text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

template <std::size_t n>
std::optional<std::uint64_t> scale(std::uint64_t number, std::string_view unit, const std::array<Unit, n>& units) {
  for (const auto& [name, factor] : units) {
    if (name != unit) continue;
    if (number > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) / factor) return std::nullopt;
    return number * factor;
  }
  return std::nullopt;
}

template <std::size_t n>
std::optional<std::uint64_t> parse_with_unit(std::string_view text, const std::array<Unit, n>& units) {
  const auto number = take_number(text);
  return number ? scale(*number, text, units) : std::nullopt;
}

/// The largest unit that divides the number.
template <std::size_t n>
std::string show_with_unit(std::uint64_t number, const std::array<Unit, n>& units) {
  const Unit* best = &units.front();
  for (const Unit& unit : units) {
    if (number != 0 && number % unit.second == 0) best = &unit;
  }
  return std::to_string(number / best->second) + std::string(best->first);
}

}  // namespace

std::uint64_t parse_size(const std::string& text, std::uint64_t least, std::uint64_t most) {
  const auto bytes = parse_with_unit(text, kSizeUnits);
  if (bytes && *bytes >= least && *bytes <= most) return *bytes;
  const std::string range =
      most == kAnySize ? "of at least " + show_size(least) : "from " + show_size(least) + " to " + show_size(most);
  throw std::invalid_argument("a size " + range + ", such as " +
                              show_size(std::clamp<std::uint64_t>(512u << 20, least, most)));
}

std::uint64_t parse_count(const std::string& text, std::uint64_t least, std::uint64_t most) {
  std::string_view rest = text;
  const auto count = take_number(rest);
  if (!count || !rest.empty() || *count < least || *count > most) {
    throw std::invalid_argument("a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return *count;
}

std::chrono::milliseconds parse_duration(const std::string& text) {
  constexpr std::uint64_t kMaxMs = 1000ull * 3'600'000;
  if (text == "0") return std::chrono::milliseconds(0);
  const auto ms = parse_with_unit(text, kTimeUnits);
  if (!ms || *ms > kMaxMs) throw std::invalid_argument("a time of up to 1000h, such as 500ms, 30s, 10m or 2h");
  return std::chrono::milliseconds(*ms);
}

std::size_t parse_choice(const std::string& text, const std::vector<std::string>& choices) {
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == text) return i;
  }
  throw std::invalid_argument("one of " + join(choices, ", "));
}

std::string parse_address(const std::string& text) {
  if (text.starts_with("unix:") && text.size() > 5) return text;
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos && colon > 0) {
    std::string_view port = std::string_view(text).substr(colon + 1);
    const auto number = take_number(port);
    if (number && port.empty() && *number <= 65'535) return text;
  }
  throw std::invalid_argument("an address HOST:PORT, such as 0.0.0.0:50051, [::]:50051 or unix:/run/ccslice.sock");
}

std::string show_size(std::uint64_t bytes) {
  // Rounded where the full number would only confuse: 3.8 GiB of memory needn't be given to the byte.
  for (const auto& [unit, name] :
       {std::pair{1ull << 30, "GiB"}, std::pair{1ull << 20, "MiB"}, std::pair{1ull << 10, "KiB"}}) {
    if (bytes < 10 * unit && bytes % unit != 0) continue;
    if (bytes >= unit) return std::to_string(bytes / unit) + name;
  }
  return std::to_string(bytes);
}

std::string show_duration(std::chrono::milliseconds duration) {
  return duration.count() == 0 ? "0" : show_with_unit(static_cast<std::uint64_t>(duration.count()), kTimeUnits);
}

bool is_local(const std::string& address) {
  return address.starts_with("unix:") || address.starts_with("127.") || address.starts_with("localhost:") ||
         address.starts_with("[::1]:");
}

std::string local_address(const std::string& listen_address) {
  if (listen_address.starts_with("unix:")) return listen_address;
  const std::size_t colon = listen_address.rfind(':');
  const std::string host = listen_address.substr(0, colon);
  const bool any = host == "0.0.0.0" || host == "[::]" || host == "*";
  return (any ? "localhost" : host) + listen_address.substr(colon);
}

std::string join(const std::vector<std::string>& parts, std::string_view separator) {
  std::string text;
  for (const std::string& part : parts) {
    if (!text.empty()) text += separator;
    text += part;
  }
  return text;
}

std::string wrap(const std::string& text, std::size_t width, const std::string& indent) {
  std::istringstream words(text);
  std::string lines;
  std::string line;
  for (std::string word; words >> word;) {
    if (!line.empty() && indent.size() + line.size() + 1 + word.size() > width) {
      lines += indent + line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return line.empty() ? lines : lines + indent + line + "\n";
}

}  // namespace ccslice::server
