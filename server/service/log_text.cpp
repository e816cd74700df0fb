// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/log_text.h"

#include <algorithm>

#include "server/service/utf8.h"

namespace ccslice::server {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

std::string hex(unsigned char byte) { return {kDigits[byte >> 4], kDigits[byte & 15]}; }

/// C0, DEL, and C1 as UTF-8 has it (0xc2 0x80 to 0xc2 0x9f).
bool is_control(std::string_view sequence) {
  const auto first = static_cast<unsigned char>(sequence[0]);
  if (sequence.size() == 1) return first < 0x20 || first == 0x7f;
  return first == 0xc2 && static_cast<unsigned char>(sequence[1]) < 0xa0;
}

/// Copies whole sequences; `escape(bytes, valid)` writes those that are control characters or not valid.
template <class Escape>
std::string copy_bounded(std::string_view text, Escape&& escape) {
  std::string out;
  while (!text.empty()) {
    if (out.size() >= kMaxLogTextBytes) return out + "...";
    const std::size_t length = utf8_sequence_length(text);
    const std::string_view sequence = text.substr(0, std::max<std::size_t>(1, length));
    out += escape(sequence, length > 0);
    text.remove_prefix(sequence.size());
  }
  return out;
}

}  // namespace

std::string to_log_line(std::string_view text) {
  return copy_bounded(text, [](std::string_view sequence, bool valid) {
    if (valid && !is_control(sequence)) return std::string(sequence);
    std::string escaped;
    for (const char byte : sequence) escaped += "\\x" + hex(static_cast<unsigned char>(byte));
    return escaped;
  });
}

std::string to_log_json(std::string_view text) {
  return copy_bounded(text, [](std::string_view sequence, bool valid) {
    if (!valid) return std::string("\xef\xbf\xbd");
    if (sequence == "\"" || sequence == "\\") return "\\" + std::string(sequence);
    if (!is_control(sequence)) return std::string(sequence);
    return "\\u00" + hex(static_cast<unsigned char>(sequence.back()));
  });
}

}  // namespace ccslice::server
