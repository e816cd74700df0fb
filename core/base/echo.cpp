// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/echo.h"

#include <algorithm>

#include "core/base/utf8.h"

namespace ccslice {
namespace {

/// The text with '?' for each control character that isn't in `kept`, and for each byte that isn't UTF-8.
std::string without_controls(std::string_view text, std::string_view kept) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t length = utf8_sequence_length(text);
    const std::string_view sequence = text.substr(0, std::max<std::size_t>(1, length));
    const bool plain = length > 0 && !is_control(utf8_code_point(sequence));
    if (plain || kept.find(text.front()) != kept.npos) {
      shown += sequence;
    } else {
      shown += '?';
    }
    text.remove_prefix(sequence.size());
  }
  return shown;
}

}  // namespace

std::string echoed(std::string_view text, std::size_t max_bytes) {
  const auto continues_character = [&](std::size_t at) {
    return (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80;
  };
  std::size_t end = text.size();
  if (end > max_bytes) {
    end = max_bytes;
    while (end > 0 && continues_character(end)) --end;
  }
  return without_controls(text.substr(0, end), "") + (end < text.size() ? "..." : "");
}

std::string harmless(std::string_view text) { return without_controls(text, "\n\t"); }

std::string echoed_list(std::span<const std::string> items, std::size_t total) {
  const std::size_t shown = std::min(items.size(), kMaxEchoItems);
  std::string text;
  for (std::size_t i = 0; i < shown; ++i) text += (i > 0 ? ", " : "") + items[i];
  if (total > shown) text += " and " + std::to_string(total - shown) + " more";
  return text;
}

}  // namespace ccslice
