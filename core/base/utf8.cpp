// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/utf8.h"

#include <algorithm>

namespace ccslice {
namespace {

struct Utf8Range {
  unsigned char least, most;
};

/// What may follow the first byte [RFC 3629, 4].
Utf8Range second_byte(unsigned char first) {
  switch (first) {
    case 0xe0: return {0xa0, 0xbf};
    case 0xed: return {0x80, 0x9f};
    case 0xf0: return {0x90, 0xbf};
    case 0xf4: return {0x80, 0x8f};
    default: return {0x80, 0xbf};
  }
}

std::size_t announced_length(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return 2;
  if (first >= 0xe0 && first < 0xf0) return 3;
  return first >= 0xf0 && first < 0xf5 ? 4 : 0;
}

}  // namespace

std::size_t utf8_sequence_length(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t length = announced_length(byte(0));
  if (length < 2) return length;
  const Utf8Range second = second_byte(byte(0));
  if (length > text.size() || byte(1) < second.least || byte(1) > second.most) return 0;
  const std::string_view rest = text.substr(2, length - 2);
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; };
  return std::all_of(rest.begin(), rest.end(), continues) ? length : 0;
}

bool is_utf8(std::string_view text) noexcept {
  while (!text.empty()) {
    const std::size_t length = utf8_sequence_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string utf8_of_latin1(std::string_view text) {
  std::string utf8;
  for (const char c : text) {
    const auto code_point = static_cast<unsigned char>(c);
    if (code_point < 0x80) {
      utf8 += c;
    } else {
      utf8 += static_cast<char>(0xc0 | code_point >> 6);
      utf8 += static_cast<char>(0x80 | (code_point & 0x3f));
    }
  }
  return utf8;
}

std::uint32_t utf8_code_point(std::string_view sequence) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(sequence[i]); };
  if (sequence.size() == 1) return byte(0);
  std::uint32_t code_point = byte(0) & (0x7fu >> sequence.size());
  for (std::size_t i = 1; i < sequence.size(); ++i) code_point = code_point << 6 | (byte(i) & 0x3fu);
  return code_point;
}

bool is_control(std::uint32_t code_point) noexcept {
  const auto within = [&](std::uint32_t least, std::uint32_t most) {
    return code_point >= least && code_point <= most;
  };
  return code_point < 0x20 || within(0x7f, 0x9f) || within(0x2028, 0x202e) || within(0x2066, 0x2069);
}

}  // namespace ccslice
