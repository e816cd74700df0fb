// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/bit_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;

/// Bit by bit.
class BitsInOrder {
 public:
  void put(std::uint64_t bits, unsigned count) {
    for (unsigned k = 0; k < count; ++k) bits_.push_back(bits >> k & 1);
  }
  void align() { bits_.resize((bits_.size() + 7) / 8 * 8); }
  std::vector<std::uint8_t> bytes() const {
    std::vector<std::uint8_t> result((bits_.size() + 7) / 8);
    for (std::size_t k = 0; k < bits_.size(); ++k) {
      if (bits_[k]) result[k / 8] |= static_cast<std::uint8_t>(1u << k % 8);
    }
    return result;
  }

 private:
  std::vector<bool> bits_;
};

TEST(BitWriter, FillsBytesFromTheLeastSignificantBitUp) {
  std::vector<std::uint8_t> out(2 + BitWriter::kSlackBytes);
  BitWriter writer(out.data());
  writer.put(0b1, 1);
  writer.put(0b01, 2);
  writer.put(0b11111, 5);
  writer.put(0b101, 3);
  writer.align();
  EXPECT_EQ(writer.at(), out.data() + 2);
  EXPECT_EQ(out[0], 0b11111011);
  EXPECT_EQ(out[1], 0b101);
}

TEST(BitWriter, WritesRandomBitsInOrder) {
  std::mt19937_64 random(kSeed);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::uint8_t> out(4096), moved(4096);
    BitWriter writer(out.data());
    BitsInOrder expected;
    unsigned pending = 0;
    std::ptrdiff_t before = 0;
    bool moves = trial % 2 == 0;
    for (int k = 0; k < 300; ++k) {
      const auto count = static_cast<unsigned>(random() % 30);
      const std::uint64_t bits = random() & ((std::uint64_t{1} << count) - 1);
      if (pending + count > 57) {
        writer.flush();
        pending = 7;
      }
      writer.put(bits, count);
      pending += count;
      expected.put(bits, count);
      if (random() % 40 == 0) {
        const std::array<std::uint8_t, 3> bytes = {1, 2, 0xfe};
        writer.align();
        writer.put_bytes(bytes.data(), bytes.size());
        expected.align();
        for (const std::uint8_t byte : bytes) expected.put(byte, 8);
        pending = 0;
      }
      if (moves && k == 150) {  // With bits pending.
        before = writer.at() - out.data();
        std::copy(out.begin(), out.begin() + before, moved.begin());
        writer.move_to(moved.data() + before);
      }
    }
    writer.align();
    const std::vector<std::uint8_t>& written = moves ? moved : out;
    const std::vector<std::uint8_t> wanted = expected.bytes();
    ASSERT_EQ(writer.at() - written.data(), static_cast<std::ptrdiff_t>(wanted.size()));
    ASSERT_TRUE(std::equal(wanted.begin(), wanted.end(), written.begin())) << "seed " << kSeed << ", trial " << trial;
  }
}

}  // namespace
}  // namespace ccslice
