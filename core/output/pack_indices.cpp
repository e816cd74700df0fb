// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/pack_indices.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

#include "core/base/error.h"
#include "core/output/byte_counts.h"
#include "core/output/polling.h"

namespace ccslice {
namespace {

static_assert(std::endian::native == std::endian::little, "the first byte of a word is its lowest");

/// The word whose bytes are numbers, times this, has them side by side in its most significant byte, the first one on
/// top: byte i is at bit 8 i and belongs at the top less (i + 1) numbers. No two of the products meet in between.
template <std::uint32_t kBits, typename Word>
constexpr Word gathering_factor() {
  constexpr std::uint32_t kTop = 8 * sizeof(Word);
  Word factor = 0;
  for (std::uint32_t i = 0; i < sizeof(Word); ++i) factor |= Word{1} << (kTop - kBits * (i + 1) - 8 * i);
  return factor;
}

/// `Word`: as many bytes as a packed byte holds numbers.
template <std::uint32_t kBits, typename Word>
void pack_row(const std::uint8_t* in, std::size_t width, std::uint8_t* out) {
  constexpr std::uint32_t kPerByte = sizeof(Word);
  static_assert(kPerByte * kBits == 8);
  constexpr auto kFactor = gathering_factor<kBits, Word>();
  const std::size_t whole = width / kPerByte;
  for (std::size_t byte = 0; byte < whole; ++byte) {
    Word numbers;
    std::memcpy(&numbers, in + byte * kPerByte, sizeof numbers);
    out[byte] = static_cast<std::uint8_t>(static_cast<Word>(numbers * kFactor) >> (8 * (kPerByte - 1)));
  }
  const auto left = static_cast<std::uint32_t>(width - whole * kPerByte);
  if (left == 0) return;
  std::uint32_t value = 0;
  for (std::uint32_t k = 0; k < left; ++k) value = value << kBits | in[whole * kPerByte + k];
  out[whole] = static_cast<std::uint8_t>(value << kBits * (kPerByte - left));
}

}  // namespace

void copy_bits(const std::uint8_t* in, std::size_t from, std::size_t count, std::uint8_t* out, std::size_t to) {
  constexpr std::size_t kByte = 8, kWord = 8 * kByte, kTogether = kWord - kByte;
  const auto go_on = [&](std::size_t bits) {
    from += bits;
    to += bits;
    count -= bits;
  };
  if ((from | to) % kByte == 0) {
    std::copy_n(in + from / kByte, count / kByte, out + to / kByte);
    go_on(count / kByte * kByte);
  }
  while (count > 0) {
    const std::size_t skipped = from % kByte, begin = to % kByte, bits = std::min(kByte - begin, count);
    if (begin == 0 && count >= kWord) {  // Seven bytes of `out` at once, of eight of `in`.
      std::uint64_t word;
      std::memcpy(&word, in + from / kByte, sizeof word);
      word = __builtin_bswap64(__builtin_bswap64(word) << skipped);
      std::memcpy(out + to / kByte, &word, kTogether / kByte);
      go_on(kTogether);
      continue;
    }
    // One byte, of up to two of `in`.
    const std::uint32_t high = in[from / kByte], low = skipped + bits > kByte ? in[from / kByte + 1] : 0;
    const std::uint32_t taken = (high << kByte | low) << skipped >> kByte & (0xff00u >> bits) & 0xff;
    out[to / kByte] = static_cast<std::uint8_t>(out[to / kByte] | taken >> begin);
    go_on(bits);
  }
}

void pack_numbers(const std::uint8_t* numbers, std::size_t count, std::uint32_t bits, std::uint8_t* packed) {
  switch (bits) {
    case 1: return pack_row<1, std::uint64_t>(numbers, count, packed);
    case 2: return pack_row<2, std::uint32_t>(numbers, count, packed);
    case 4: return pack_row<4, std::uint16_t>(numbers, count, packed);
    default: std::copy_n(numbers, count, packed);
  }
}

std::uint32_t bits_per_index(SampleType type) {
  switch (type) {
    case SampleType::kBit: return 1;
    case SampleType::kUint2: return 2;
    case SampleType::kUint4: return 4;
    case SampleType::kUint8: return 8;
    case SampleType::kUint16:
    case SampleType::kFloat32: return 0;
  }
  return 0;
}

SampleType smallest_index_type(std::size_t materials) {
  if (materials < 2) return SampleType::kBit;
  if (materials < 4) return SampleType::kUint2;
  return materials < 16 ? SampleType::kUint4 : SampleType::kUint8;
}

void require_known_materials(const IndexImage& image) {
  std::uint8_t largest = 0;
  for (const std::uint8_t index : image.indices) largest = std::max(largest, index);
  if (largest < image.palette.size()) return;
  throw Error(ErrorCode::kInternal, "a voxel of material " + std::to_string(largest) + " where there are " +
                                        std::to_string(image.palette.size() - 1));
}

std::vector<std::uint64_t> count_materials(const IndexImage& image, const CancellationToken& cancel) {
  require_known_materials(image);
  ByteCounts counts;
  for (std::uint32_t y = 0; y < image.height; ++y) {
    if (y % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    counts.add(image.indices.subspan(std::size_t{image.width} * y, image.width));
  }
  std::vector<std::uint64_t> voxels;
  for (std::size_t number = 0; number < image.palette.size(); ++number) voxels.push_back(counts[number]);
  return voxels;
}

void pack_mask(const IndexImage& image, MaterialSet materials, std::vector<std::uint8_t>& packed,
               const CancellationToken& cancel) {
  const LayerWindow window = image_window(image);
  const std::size_t row_bytes = (std::size_t{window.columns} + 7) / 8;
  std::vector<std::uint8_t> row(window.columns);
  packed.resize(row_bytes * window.rows);
  for (std::uint32_t y = 0; y < window.rows; ++y) {
    if (y % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    const auto indices = image.indices.subspan(std::size_t{window.columns} * y, window.columns);
    std::fill(row.begin(), row.end(), std::uint8_t{0});
    for (MaterialSet left = materials; left != 0; left &= left - 1) {
      const auto material = static_cast<std::uint8_t>(std::countr_zero(left));
      for (std::size_t x = 0; x < row.size(); ++x) row[x] |= static_cast<std::uint8_t>(indices[x] == material);
    }
    pack_numbers(row.data(), window.columns, 1, &packed[row_bytes * y]);
  }
}

void pack_indices(const IndexImage& image, std::uint32_t bits, std::vector<std::uint8_t>& packed,
                  const CancellationToken& cancel) {
  const LayerWindow window = image_window(image);
  const std::size_t row_bytes = (std::size_t{window.columns} * bits + 7) / 8;
  packed.resize(row_bytes * window.rows);
  for (std::uint32_t y = 0; y < window.rows; ++y) {
    if (y % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    pack_numbers(&image.indices[std::size_t{window.columns} * y], window.columns, bits, &packed[row_bytes * y]);
  }
}

}  // namespace ccslice
