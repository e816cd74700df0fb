// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtu_array.h"

#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/mesh_import/byte_order.h"

namespace ccslice {
namespace {

[[noreturn]] void fail(const TextScanner& place, const std::string& message) {
  place.fail_with(ErrorCode::kFileSyntax, message + "; write the file anew");
}

/// The value of a digit in base64; 64 for '=', 255 for all others.
std::uint8_t digit(char c) {
  if (c >= 'A' && c <= 'Z') return static_cast<std::uint8_t>(c - 'A');
  if (c >= 'a' && c <= 'z') return static_cast<std::uint8_t>(c - 'a' + 26);
  if (c >= '0' && c <= '9') return static_cast<std::uint8_t>(c - '0' + 52);
  if (c == '+') return 62;
  if (c == '/') return 63;
  return c == '=' ? 64 : 255;
}

/// Bytes one after the other, from themselves or from base64.
class EncodedBytes {
 public:
  EncodedBytes(std::string_view text, bool base64, const TextScanner& place)
      : text_(text), base64_(base64), place_(place) {}

  /// The next `size` bytes, valid until the next call.
  std::string_view take(std::uint64_t size) {
    if (size > (base64_ ? left_over_.size() + text_.size() / 4 * 3 : text_.size())) fail_early();
    if (!base64_) {
      const std::string_view bytes = text_.substr(0, size);
      text_.remove_prefix(size);
      return bytes;
    }
    taken_ = std::move(left_over_);
    while (taken_.size() < size) take_four();
    left_over_ = taken_.substr(size);
    taken_.resize(size);
    return taken_;
  }

 private:
  [[noreturn]] void fail_early() const { fail(place_, "the array's data end early"); }

  /// Four digits are three bytes; padding in their place ends a text, and another may follow.
  void take_four() {
    std::array<std::uint8_t, 4> digits{};
    for (std::uint8_t& value : digits) {
      while (!text_.empty() && is_blank(text_.front())) text_.remove_prefix(1);
      if (text_.empty()) fail_early();
      value = digit(text_.front());
      if (value == 255) fail(place_, in_quotes(printable(text_.substr(0, 1))) + " is no digit of base64");
      text_.remove_prefix(1);
    }
    const std::size_t padding = (digits[2] == 64) + (digits[3] == 64);
    if (digits[0] == 64 || digits[1] == 64 || (digits[2] == 64 && digits[3] != 64)) {
      fail(place_, "'=' stands in the middle of base64");
    }
    const std::uint32_t bits = static_cast<std::uint32_t>(digits[0]) << 18 |
                               static_cast<std::uint32_t>(digits[1]) << 12 |
                               static_cast<std::uint32_t>(digits[2] & 63) << 6 | (digits[3] & 63u);
    for (std::size_t i = 0; i + padding < 3; ++i) taken_ += static_cast<char>(bits >> (16 - 8 * i) & 0xff);
  }

  std::string_view text_;
  const bool base64_;
  const TextScanner& place_;
  std::string taken_, left_over_;
};

std::uint64_t take_word(EncodedBytes& bytes, const VtuCoding& coding) {
  return number_in_bytes(bytes.take(coding.header_word_bytes), coding.big_endian);
}

[[noreturn]] void fail_to_inflate(std::uint64_t size, const TextScanner& place) {
  fail(place, "a block of the array doesn't inflate to the " + std::to_string(size) + " bytes that its header claims");
}

constexpr std::size_t kBufferBytes = 1 << 15;

/// Appends what the block inflates to, which has to be `size` bytes.
void inflate_zlib(std::string_view block, std::uint64_t size, const TextScanner& place, std::string& bytes) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw Error(ErrorCode::kInternal, "zlib doesn't start");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(block.data()));
  std::array<char, kBufferBytes> buffer;
  std::uint64_t produced = 0;
  int status = Z_OK;
  while (status == Z_OK) {
    constexpr std::size_t kMostAtOnce = 1u << 30;
    const std::size_t consumed = static_cast<std::size_t>(reinterpret_cast<const char*>(stream.next_in) - block.data());
    stream.avail_in = static_cast<uInt>(std::min(block.size() - consumed, kMostAtOnce));
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(buffer.size());
    status = inflate(&stream, Z_NO_FLUSH);
    const std::size_t count = buffer.size() - stream.avail_out;
    produced += count;
    if (produced > size) break;
    bytes.append(buffer.data(), count);
  }
  if (status != Z_STREAM_END || produced != size) fail_to_inflate(size, place);
}

void inflate_lz4(std::string_view block, std::uint64_t size, const TextScanner& place, std::string& bytes) {
  constexpr std::uint64_t kMostBytesPerByte = 256;  // A byte of a length stands for 255 bytes at most.
  const bool may_be = size <= LZ4_MAX_INPUT_SIZE && block.size() <= LZ4_MAX_INPUT_SIZE &&
                      size <= kMostBytesPerByte * (block.size() + 1);
  if (!may_be) fail_to_inflate(size, place);
  const std::size_t before = bytes.size();
  bytes.resize(before + size);
  const int produced =
      LZ4_decompress_safe(block.data(), bytes.data() + before, static_cast<int>(block.size()), static_cast<int>(size));
  if (produced < 0 || static_cast<std::uint64_t>(produced) != size) fail_to_inflate(size, place);
}

void inflate_lzma(std::string_view block, std::uint64_t size, const TextScanner& place, std::string& bytes) {
  constexpr std::uint64_t kMostMemoryBytes = 128 << 20;  // The highest level of compression takes half of it.
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, kMostMemoryBytes, 0) != LZMA_OK) {
    throw Error(ErrorCode::kInternal, "liblzma doesn't start");
  }
  const std::unique_ptr<lzma_stream, void (*)(lzma_stream*)> end(&stream, lzma_end);
  stream.next_in = reinterpret_cast<const std::uint8_t*>(block.data());
  stream.avail_in = block.size();
  std::array<char, kBufferBytes> buffer;
  std::uint64_t produced = 0;
  lzma_ret status = LZMA_OK;
  while (status == LZMA_OK) {
    stream.next_out = reinterpret_cast<std::uint8_t*>(buffer.data());
    stream.avail_out = buffer.size();
    status = lzma_code(&stream, LZMA_FINISH);
    const std::size_t count = buffer.size() - stream.avail_out;
    produced += count;
    if (produced > size) break;
    bytes.append(buffer.data(), count);
  }
  if (status != LZMA_STREAM_END || produced != size) fail_to_inflate(size, place);
}

void inflate_block(VtuCompressor compressor, std::string_view block, std::uint64_t size, const TextScanner& place,
                   std::string& bytes) {
  switch (compressor) {
    case VtuCompressor::kZlib: return inflate_zlib(block, size, place, bytes);
    case VtuCompressor::kLz4: return inflate_lz4(block, size, place, bytes);
    case VtuCompressor::kLzma: return inflate_lzma(block, size, place, bytes);
    case VtuCompressor::kNone:
    case VtuCompressor::kUnknown: break;
  }
  throw Error(ErrorCode::kInternal, "an array is inflated by no compressor");
}

void fail_unless_equal(std::uint64_t claimed, std::uint64_t expected, const TextScanner& place) {
  if (claimed == expected) return;
  fail(place, "the array's header claims " + std::to_string(claimed) + " bytes, but its values take " +
                  std::to_string(expected));
}

std::string inflate_all(EncodedBytes& encoded, const VtuCoding& coding, std::uint64_t expected_bytes,
                        const TextScanner& place) {
  const std::uint64_t blocks = take_word(encoded, coding);
  if (blocks == 0) {
    fail_unless_equal(0, expected_bytes, place);
    return {};
  }
  const std::uint64_t block_bytes = take_word(encoded, coding), last_bytes = take_word(encoded, coding);
  const std::uint64_t whole = last_bytes == 0 ? blocks : blocks - 1;
  const bool fits = last_bytes <= expected_bytes && (whole == 0 || block_bytes <= expected_bytes / whole);
  if (!fits)
    fail(place, "the array's header claims more bytes than the " + std::to_string(expected_bytes) + " of its values");
  fail_unless_equal(whole * block_bytes + last_bytes, expected_bytes, place);
  std::vector<std::uint64_t> compressed;
  for (std::uint64_t i = 0; i < blocks; ++i) compressed.push_back(take_word(encoded, coding));
  std::string bytes;
  for (std::uint64_t i = 0; i < blocks; ++i) {
    inflate_block(coding.compressor, encoded.take(compressed[i]), i < whole ? block_bytes : last_bytes, place, bytes);
  }
  return bytes;
}

}  // namespace

std::string decode_vtu_array(std::string_view text, bool base64, const VtuCoding& coding, std::uint64_t expected_bytes,
                             const TextScanner& place) {
  EncodedBytes encoded(text, base64, place);
  if (coding.compressor != VtuCompressor::kNone) return inflate_all(encoded, coding, expected_bytes, place);
  fail_unless_equal(take_word(encoded, coding), expected_bytes, place);
  return std::string(encoded.take(expected_bytes));
}

}  // namespace ccslice
