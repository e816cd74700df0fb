// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Bits to bytes as deflate wants them [RFC 1951, 3.1.1]: from the least significant bit of each byte up.

#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ccslice {

static_assert(std::endian::native == std::endian::little, "whole words are stored");

/// A place to write at. Small enough for inner loops to keep a copy in registers.
class BitWriter {
 public:
  /// Room that flush() may touch beyond the last whole byte.
  static constexpr std::size_t kSlackBytes = 8;

  explicit BitWriter(std::uint8_t* at) : at_(at) {}

  /// REQUIRES: no bits of `bits` above `count`, and at most 57 bits since the last flush().
  void put(std::uint64_t bits, unsigned count) {
    pending_ |= bits << pending_bits_;
    pending_bits_ += count;
  }
  /// Writes the whole bytes among the pending bits; fewer than 8 bits stay.
  void flush() {
    std::memcpy(at_, &pending_, sizeof pending_);
    at_ += pending_bits_ >> 3;
    pending_ >>= pending_bits_ & ~7u;
    pending_bits_ &= 7;
  }
  /// Pads with zeros to a whole byte.
  void align() {
    flush();
    pending_bits_ = (pending_bits_ + 7) & ~7u;
    flush();
  }
  /// REQUIRES: aligned.
  void put_bytes(const std::uint8_t* bytes, std::size_t count) {
    std::memcpy(at_, bytes, count);
    at_ += count;
  }
  /// Where the next byte goes.
  std::uint8_t* at() const { return at_; }
  /// Goes on elsewhere, pending bits and all.
  void move_to(std::uint8_t* at) { at_ = at; }

 private:
  std::uint8_t* at_;
  std::uint64_t pending_ = 0;
  unsigned pending_bits_ = 0;
};

}  // namespace ccslice
