// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtu_array.h"

#include <gtest/gtest.h>
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <random>
#include <string>
#include <vector>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0);
    }
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63];
  }
  return text;
}

std::string word(std::uint64_t value, const VtuCoding& coding) {
  std::string bytes;
  for (std::size_t i = 0; i < coding.header_word_bytes; ++i) {
    const std::size_t shift = coding.big_endian ? coding.header_word_bytes - 1 - i : i;
    bytes += static_cast<char>(value >> (8 * shift) & 0xff);
  }
  return bytes;
}

std::string packed_by_lz4(const std::string& bytes) {
  std::string result(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(bytes.size()))), '\0');
  const int size = LZ4_compress_default(bytes.data(), result.data(), static_cast<int>(bytes.size()),
                                        static_cast<int>(result.size()));
  EXPECT_GT(size, 0);
  result.resize(static_cast<std::size_t>(size));
  return result;
}

std::string packed_by_lzma(const std::string& bytes) {
  std::string result(lzma_stream_buffer_bound(bytes.size()), '\0');
  std::size_t size = 0;
  EXPECT_EQ(lzma_easy_buffer_encode(5, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                    bytes.size(), reinterpret_cast<std::uint8_t*>(result.data()), &size, result.size()),
            LZMA_OK);
  result.resize(size);
  return result;
}

std::string packed(const std::string& bytes, VtuCompressor compressor) {
  if (compressor == VtuCompressor::kLz4) return packed_by_lz4(bytes);
  if (compressor == VtuCompressor::kLzma) return packed_by_lzma(bytes);
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                     bytes.size()),
            Z_OK);
  result.resize(size);
  return result;
}

struct Encoded {
  std::string header, data;
  std::string raw() const { return header + data; }
};

Encoded encode(const std::string& bytes, const VtuCoding& coding, std::size_t block) {
  if (coding.compressor == VtuCompressor::kNone) return {word(bytes.size(), coding), bytes};
  std::vector<std::string> blocks;
  for (std::size_t at = 0; at < bytes.size(); at += block) {
    blocks.push_back(packed(bytes.substr(at, block), coding.compressor));
  }
  Encoded result{word(blocks.size(), coding) + word(block, coding) + word(bytes.size() % block, coding), {}};
  for (const std::string& compressed : blocks) {
    result.header += word(compressed.size(), coding);
    result.data += compressed;
  }
  return result;
}

std::string decode(const std::string& text, bool base64, const VtuCoding& coding, std::uint64_t expected) {
  TextScanner place("");
  place.name_one_byte(77);
  return decode_vtu_array(text, base64, coding, expected, place);
}

TEST(VtuArray, OfAnyLengthIsDecodedInEveryCoding) {
  constexpr unsigned kSeed = 20240605;
  std::mt19937 random(kSeed);
  for (std::size_t length = 0; length < 70; ++length) {
    std::string bytes(length, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    for (unsigned choice = 0; choice < 16; ++choice) {
      constexpr VtuCompressor kAll[] = {VtuCompressor::kNone, VtuCompressor::kZlib, VtuCompressor::kLz4,
                                        VtuCompressor::kLzma};
      const VtuCoding coding{(choice & 1) != 0, static_cast<std::uint8_t>(choice & 2 ? 8 : 4), kAll[choice / 4]};
      const Encoded encoded = encode(bytes, coding, 16);
      SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", length " << length << ", coding " << choice);
      EXPECT_EQ(decode(encoded.raw() + "more", false, coding, length), bytes);
      EXPECT_EQ(decode(base64(encoded.raw()), true, coding, length), bytes) << "one text";
      const std::string two = "\n  " + base64(encoded.header) + base64(encoded.data) + "QUJD\n ";
      EXPECT_EQ(decode(two, true, coding, length), bytes) << "two texts, and more behind them";
    }
  }
}

void expect_refused(const std::string& text, bool base64, const VtuCoding& coding, std::uint64_t expected,
                    const std::string& part) {
  SCOPED_TRACE(part);
  expect_error([&] { decode(text, base64, coding, expected); }, ErrorCode::kFileSyntax, "byte 77: " + part);
}

TEST(VtuArray, HasTheBytesThatItsValuesTake) {
  const VtuCoding coding;
  const std::string raw = encode("twelve bytes", coding, 0).raw();
  expect_refused(raw, false, coding, 16, "the array's header claims 12 bytes, but its values take 16; write");
  expect_refused(raw.substr(0, 15), false, coding, 12, "the array's data end early");
  expect_refused(raw.substr(0, 3), false, coding, 12, "the array's data end early");
  expect_refused(base64(raw).substr(0, 12), true, coding, 12, "the array's data end early");
  expect_refused("AAAA!AAA", true, coding, 12, "'!' is no digit of base64");
  expect_refused("AA=AAAAA", true, coding, 12, "'=' stands in the middle");
  expect_refused(word(~0u, coding), false, coding, 12, "the array's header claims 4294967295 bytes");
}

class CompressedVtuArray : public testing::TestWithParam<VtuCompressor> {};

INSTANTIATE_TEST_SUITE_P(VtuArray, CompressedVtuArray,
                         testing::Values(VtuCompressor::kZlib, VtuCompressor::kLz4, VtuCompressor::kLzma));

TEST_P(CompressedVtuArray, NeverInflatesMoreThanItsValuesTake) {
  VtuCoding coding;
  coding.compressor = GetParam();
  coding.header_word_bytes = 8;
  const std::string zeros = packed(std::string(1 << 20, '\0'), GetParam());
  const auto block = [&](std::uint64_t blocks, std::uint64_t size, std::uint64_t last, std::uint64_t compressed) {
    return word(blocks, coding) + word(size, coding) + word(last, coding) + word(compressed, coding) + zeros;
  };
  EXPECT_EQ(decode(block(1, 1 << 20, 0, zeros.size()), false, coding, 1 << 20).size(), 1u << 20);
  expect_refused(block(1, 100, 0, zeros.size()), false, coding, 100, "a block of the array doesn't inflate to the 100");
  expect_refused(block(1, 1 << 21, 0, zeros.size()), false, coding, 1 << 21, "a block of the array doesn't inflate");
  expect_refused(block(1, 1 << 20, 0, zeros.size() - 9), false, coding, 1 << 20,
                 "a block of the array doesn't inflate");
  expect_refused(block(1, 1 << 20, 0, 1 << 20), false, coding, 1 << 20, "the array's data end early");
  expect_refused(block(~0ull, 2, 2, 1), false, coding, 1 << 20, "the array's header claims more bytes");
  expect_refused(block(~0ull, 0, 100, 1), false, coding, 100, "");
  expect_refused(block(2, ~0ull, 0, 1), false, coding, 1 << 20, "the array's header claims more bytes");
  expect_refused(block(1, 0, ~0ull, 1), false, coding, 1 << 20, "the array's header claims more bytes");
  expect_refused(block(2, 400, 0, 1), false, coding, 1000, "the array's header claims 800 bytes");
  expect_refused(word(0, coding), false, coding, 8, "the array's header claims 0 bytes");
  expect_refused(block(1, 20, 0, 5).substr(0, 32) + "garbage", false, coding, 20,
                 "a block of the array doesn't inflate");
}

}  // namespace
}  // namespace ccslice
