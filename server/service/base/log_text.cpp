// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/log_text.h"

#include <algorithm>

#include "core/base/utf8.h"

namespace ccslice::server {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

std::string hex(unsigned char byte) { return {kDigits[byte >> 4], kDigits[byte & 15]}; }

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
    if (valid && !is_control(utf8_code_point(sequence))) return std::string(sequence);
    std::string escaped;
    for (const char byte : sequence) escaped += "\\x" + hex(static_cast<unsigned char>(byte));
    return escaped;
  });
}

std::string to_log_json(std::string_view text) {
  return copy_bounded(text, [](std::string_view sequence, bool valid) {
    if (!valid) return std::string("\xef\xbf\xbd");
    if (sequence == "\"" || sequence == "\\") return "\\" + std::string(sequence);
    const std::uint32_t code_point = utf8_code_point(sequence);
    if (!is_control(code_point)) return std::string(sequence);
    return "\\u" + hex(static_cast<unsigned char>(code_point >> 8)) + hex(static_cast<unsigned char>(code_point));
  });
}

}  // namespace ccslice::server
