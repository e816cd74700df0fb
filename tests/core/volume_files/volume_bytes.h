// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Samples as files have them, and what readers make of them.

#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/volume/load_sample.h"
#include "core/volume_files/volume_file.h"

namespace ccslice {

/// The numbers as the bytes of `Number`, the last ones first where the file's byte order is big-endian.
template <typename Number>
std::string raw(const std::vector<Number>& numbers, bool big_endian = false) {
  std::string bytes;
  for (const Number number : numbers) {
    std::string own(sizeof(Number), '\0');
    std::memcpy(own.data(), &number, sizeof(Number));
    if (big_endian) own = std::string(own.rbegin(), own.rend());
    bytes += own;
  }
  return bytes;
}

/// A volume's samples as numbers, in its order.
inline std::vector<double> numbers_of(const VolumeFile& file) {
  std::vector<double> numbers;
  with_sample_type(file.shape.type, [&](auto sample) {
    using Sample = decltype(sample);
    for (std::size_t s = 0; s < file.samples.size() / sizeof(Sample); ++s) {
      numbers.push_back(static_cast<double>(load_sample<Sample>(file.samples.data(), s)));
    }
  });
  return numbers;
}

/// 3 x 2 x 1 of them, as whole numbers of 16 bits.
inline std::string six_samples() { return raw<std::int16_t>({1, 2, 3, -4, 5, 600}); }
inline void expect_six_samples(const VolumeFile& file) {
  EXPECT_EQ(file.shape.samples, (std::array<std::uint32_t, 3>{3, 2, 1}));
  EXPECT_EQ(file.shape.channels, 1u);
  EXPECT_THAT(numbers_of(file), testing::ElementsAre(1, 2, 3, -4, 5, 600));
}

/// `window_bits`: 15 for zlib's streams, 15 + 16 for gzip's.
inline std::string deflated(const std::string& bytes, int window_bits) {
  z_stream stream{};
  if (deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  std::string packed(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  if (deflate(&stream, Z_FINISH) != Z_STREAM_END) throw std::runtime_error("deflate");
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}
inline std::string gzipped(const std::string& bytes) { return deflated(bytes, 15 + 16); }
inline std::string zlibbed(const std::string& bytes) { return deflated(bytes, 15); }

}  // namespace ccslice
