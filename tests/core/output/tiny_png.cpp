// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/core/output/tiny_png.h"

#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace ccslice {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::runtime_error(std::string("not a plain PNG: ") + what);
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 | bytes[3];
}

std::uint8_t paeth(int a, int b, int c) {
  const int p = a + b - c;
  const int pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
  return static_cast<std::uint8_t>(pa <= pb && pa <= pc ? a : pb <= pc ? b : c);
}

std::size_t bits_per_voxel(const TinyPng& png) {
  return png.bit_depth * std::size_t{png.color_type == 6 ? 4u : png.color_type == 4 ? 2u : 1u};
}

std::size_t png_row_bytes(const TinyPng& png) { return (bits_per_voxel(png) * png.width + 7) / 8; }

void unfilter(TinyPng& png, std::span<const std::uint8_t> filtered) {
  const std::size_t step = std::max<std::size_t>(1, bits_per_voxel(png) / 8);
  const std::size_t row_bytes = png_row_bytes(png);
  require(filtered.size() == (row_bytes + 1) * png.height, "wrong amount of image data");
  png.samples.resize(row_bytes * png.height);
  const std::vector<std::uint8_t> zeros(row_bytes);
  for (std::size_t y = 0; y < png.height; ++y) {
    const std::uint8_t filter = filtered[(row_bytes + 1) * y];
    const std::uint8_t* in = &filtered[(row_bytes + 1) * y + 1];
    const std::uint8_t* above = y == 0 ? zeros.data() : &png.samples[row_bytes * (y - 1)];
    std::uint8_t* out = &png.samples[row_bytes * y];
    for (std::size_t i = 0; i < row_bytes; ++i) {
      const int a = i < step ? 0 : out[i - step];
      const int b = above[i];
      const int c = i < step ? 0 : above[i - step];
      const int predicted[] = {0, a, b, (a + b) / 2, paeth(a, b, c)};
      require(filter < 5, "unknown row filter");
      out[i] = static_cast<std::uint8_t>(in[i] + predicted[filter]);
    }
  }
}

void read_header(TinyPng& png, std::span<const std::uint8_t> data) {
  require(data.size() == 13, "header");
  png.width = big_endian(data);
  png.height = big_endian(data.subspan(4));
  png.bit_depth = data[8];
  png.color_type = data[9];
  const bool depth = png.bit_depth == 8 || (png.color_type == 0 && (png.bit_depth == 1 || png.bit_depth == 16)) ||
                     (png.color_type == 4 && png.bit_depth == 16) ||
                     (png.color_type == 3 && (png.bit_depth == 1 || png.bit_depth == 2 || png.bit_depth == 4));
  const bool type = png.color_type == 0 || png.color_type == 3 || png.color_type == 4 || png.color_type == 6;
  require(depth && type && data[10] == 0 && data[11] == 0 && data[12] == 0, "kind of picture");
}

}  // namespace

TinyPng read_tiny_png(std::span<const std::uint8_t> file) {
  const std::uint8_t signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  require(file.size() > 8 && std::equal(std::begin(signature), std::end(signature), file.begin()), "signature");
  file = file.subspan(8);
  TinyPng png;
  std::vector<std::uint8_t> deflated;
  while (!file.empty()) {
    require(file.size() >= 12, "cut off");
    const std::uint32_t length = big_endian(file);
    require(file.size() >= std::size_t{12} + length, "cut off");
    const auto named = file.subspan(4, std::size_t{4} + length);
    const auto data = named.subspan(4);
    require(crc32_z(0, named.data(), named.size()) == big_endian(file.subspan(8 + length)), "chunk checksum");
    png.chunks.emplace_back(named.begin(), named.begin() + 4);
    if (png.chunks.back() == "IHDR") read_header(png, data);
    if (png.chunks.back() == "PLTE") png.palette.assign(data.begin(), data.end());
    if (png.chunks.back() == "tRNS") png.alphas.assign(data.begin(), data.end());
    if (png.chunks.back() == "IDAT") deflated.insert(deflated.end(), data.begin(), data.end());
    file = file.subspan(std::size_t{12} + length);
  }
  require(!png.chunks.empty() && png.chunks.front() == "IHDR" && png.chunks.back() == "IEND", "first or last chunk");
  std::vector<std::uint8_t> filtered((png_row_bytes(png) + 1) * png.height);
  uLongf size = filtered.size();
  require(uncompress(filtered.data(), &size, deflated.data(), deflated.size()) == Z_OK, "deflate");
  filtered.resize(size);
  unfilter(png, filtered);
  return png;
}

}  // namespace ccslice
