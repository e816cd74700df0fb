// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The histogram of bytes that Huffman codes are made from.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ccslice {

/// How often each byte occurs. Four counters a byte, so that runs of one don't wait for each other.
class ByteCounts {
 public:
  /// REQUIRES: fewer than 2^32 bytes in all.
  void add(std::span<const std::uint8_t> bytes) {
    std::size_t i = 0;
    for (; i + 4 <= bytes.size(); i += 4) {
      for (std::size_t lane = 0; lane < 4; ++lane) ++counts_[lane][bytes[i + lane]];
    }
    for (; i < bytes.size(); ++i) ++counts_[0][bytes[i]];
  }
  std::uint32_t operator[](std::size_t byte) const {
    return counts_[0][byte] + counts_[1][byte] + counts_[2][byte] + counts_[3][byte];
  }

 private:
  std::array<std::array<std::uint32_t, 256>, 4> counts_{};
};

}  // namespace ccslice
