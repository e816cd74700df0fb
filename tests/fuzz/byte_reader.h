// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a fuzz target makes its input of: the bytes it is given, from the first to the last, and zeros after them.

#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

namespace ccslice::fuzz {

class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

  bool at_end() const { return at_ == end_; }
  std::uint8_t next() { return at_end() ? 0 : *at_++; }
  /// So many bytes, or those that are left.
  std::string take(std::size_t count) {
    const std::uint8_t* const begin = at_;
    at_ += std::min(count, static_cast<std::size_t>(end_ - at_));
    return {begin, at_};
  }
  std::string rest() { return take(static_cast<std::size_t>(end_ - at_)); }
  /// The next message of a stream: two bytes of length, the lower one first, and so many bytes.
  std::string message() {
    const std::size_t low = next();
    return take(low | std::size_t{next()} << 8);
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

}  // namespace ccslice::fuzz
