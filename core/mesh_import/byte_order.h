// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Numbers in files whose byte order isn't this machine's.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace ccslice {

/// Up to eight bytes as a number.
inline std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

inline std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) value = value << 8 | static_cast<std::uint8_t>(bytes[i - 1]);
  return value;
}

inline std::uint64_t number_in_bytes(std::string_view bytes, bool is_big_endian) {
  return is_big_endian ? big_endian(bytes) : little_endian(bytes);
}

}  // namespace ccslice
