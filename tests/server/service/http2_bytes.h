// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// HTTP/2 byte by byte (RFC 9113), with headers in HPACK (RFC 7541), as no library would send it.

#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ccslice::server {

inline std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// A text without Huffman's code.
inline std::string hpack_text(const std::string& text) {
  if (text.size() < 127) return static_cast<char>(text.size()) + text;
  std::string length = "\x7f";
  std::size_t more = text.size() - 127;
  for (; more >= 128; more >>= 7) length += static_cast<char>(more | 128);
  return length + static_cast<char>(more) + text;
}

inline constexpr char kKept = 0x40;  // By the dynamic table.

inline std::string literal(const std::string& name, const std::string& value, char how = 0) {
  return how + hpack_text(name) + hpack_text(value);
}

inline constexpr char kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kContinuation = 9;
inline constexpr char kAck = 1, kEndHeaders = 4;

inline std::string frame(char kind, char flags, std::uint32_t stream, const std::string& payload) {
  std::string header;
  for (const int shift : {16, 8, 0}) header += static_cast<char>(payload.size() >> shift);
  header += {kind, flags};
  for (const int shift : {24, 16, 8, 0}) header += static_cast<char>(stream >> shift);
  return header + payload;
}

inline const std::string kGreeting = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(kSettings, 0, 0, "");

/// Of a call of this path.
inline std::string request_list(const std::string& path) {
  return literal(":method", "POST") + literal(":scheme", "http") + literal(":path", path) +
         literal(":authority", "server") + literal("te", "trailers") + literal("content-type", "application/grpc");
}

inline std::string reset(std::uint32_t stream) { return frame(kReset, 0, stream, std::string("\0\0\0\b", 4)); }

}  // namespace ccslice::server
