// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a message may repeat of its input: never so much that the message gets lost. Transports bound the size of errors
// (gRPC clients take 8 KiB of trailers by default), and a terminal shows what it is told.

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice {

/// Longest echo of one name, bytes, and most items of one list.
inline constexpr std::size_t kMaxEchoBytes = 64;
inline constexpr std::size_t kMaxEchoItems = 8;

/// `text` cut to `max_bytes` where need be, between characters of UTF-8, with "..." after the cut. Control characters
/// (utf8.h) and bytes that aren't UTF-8 become '?'.
std::string echoed(std::string_view text, std::size_t max_bytes = kMaxEchoBytes);

/// `text` for a terminal: as echoed(), but whole, and with its line ends and tabs.
std::string harmless(std::string_view text);

/// "3, 17, 22": the first kMaxEchoItems of `items`, then "and N more" of `total`.
std::string echoed_list(std::span<const std::string> items, std::size_t total);

/// The list of the items' names, each between two of `quote`.
template <typename Items>
std::string echoed_names(const Items& items, char quote) {
  std::vector<std::string> names;
  for (const auto& item : items) {
    if (names.size() == kMaxEchoItems) break;
    names.push_back(quote + echoed(item.name) + quote);
  }
  return echoed_list(names, items.size());
}

}  // namespace ccslice
