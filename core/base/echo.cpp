// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/echo.h"

#include <algorithm>

namespace ccslice {

std::string echoed(std::string_view text, std::size_t max_bytes) {
  const auto continues_character = [&](std::size_t at) {
    return (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80;
  };
  std::size_t end = text.size();
  if (end > max_bytes) {
    end = max_bytes;
    while (end > 0 && continues_character(end)) --end;
  }
  std::string echo(text.substr(0, end));
  for (char& c : echo) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return end < text.size() ? echo + "..." : echo;
}

std::string echoed_list(std::span<const std::string> items, std::size_t total) {
  const std::size_t shown = std::min(items.size(), kMaxEchoItems);
  std::string text;
  for (std::size_t i = 0; i < shown; ++i) text += (i > 0 ? ", " : "") + items[i];
  if (total > shown) text += " and " + std::to_string(total - shown) + " more";
  return text;
}

}  // namespace ccslice
