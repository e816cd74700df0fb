// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/png_file.h"

#include <libdeflate.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string_view>

#include "client/cli/base/text_values.h"

namespace ccslice::cli {
namespace {

constexpr std::size_t kComponents = 3;
constexpr char kFilterNone = 0, kFilterUp = 2;
constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

void append_number(std::string& bytes, std::size_t number) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xff);
}

void append_chunk(std::string& png, std::string_view type, const std::string& data) {
  append_number(png, data.size());
  const std::string body = std::string(type) + data;
  png += body;
  append_number(png, libdeflate_crc32(0, body.data(), body.size()));
}

std::string filtered_rows(const Picture& picture) {
  const std::size_t row_bytes = kComponents * static_cast<std::size_t>(picture.width);
  std::string rows;
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    if (i % row_bytes == 0) rows += kFilterUp;
    const int above = i < row_bytes ? 0 : picture.rgb[i - row_bytes];
    rows += static_cast<char>(picture.rgb[i] - above);
  }
  return rows;
}

std::string deflated(const std::string& bytes, int level) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string packed(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  packed.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), packed.data(), packed.size()));
  return packed;
}

/// Whether the bytes unpack to just so many.
bool inflate(const std::string& packed, std::string& bytes) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  return libdeflate_zlib_decompress(decompressor.get(), packed.data(), packed.size(), bytes.data(), bytes.size(),
                                    nullptr) == LIBDEFLATE_SUCCESS;
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number = number << 8 | static_cast<unsigned char>(bytes[at + i]);
  return number;
}

std::string header_of(std::uint32_t width, std::uint32_t height, char colour_type) {
  std::string header;
  append_number(header, width);
  append_number(header, height);
  return header +
         std::string{'\x08', colour_type, '\0', '\0', '\0'};  // 8 bits; deflate, filters by row, not interlaced.
}

}  // namespace

std::optional<std::string> grey_samples(std::string_view png, std::uint32_t width, std::uint32_t height) {
  constexpr char kGrey = 0;
  constexpr std::size_t kAroundData = 12;  // A chunk's length, name and checksum.
  if (!png.starts_with(kSignature)) return std::nullopt;
  std::string packed;
  bool fits = false;
  for (std::size_t at = kSignature.size(); png.size() - at >= kAroundData;) {
    const std::size_t length = number_at(png, at);
    if (length > png.size() - at - kAroundData) return std::nullopt;
    const std::string_view name = png.substr(at + 4, 4), data = png.substr(at + 8, length);
    if (name == "IHDR") fits = data == header_of(width, height, kGrey);
    if (name == "IDAT") packed += data;
    at += kAroundData + length;
  }
  constexpr std::size_t kMostOfAByte = 1032;  // What deflate can make of one: 258 of two bits.
  const std::size_t bytes = (std::size_t{width} + 1) * height;
  if (!fits || bytes > kMostOfAByte * packed.size()) return std::nullopt;
  std::string rows(bytes, '\0');
  if (!inflate(packed, rows)) return std::nullopt;
  std::string samples;
  for (std::size_t y = 0; y < height; ++y) {
    const std::string_view row = std::string_view(rows).substr((std::size_t{width} + 1) * y, std::size_t{width} + 1);
    if (row[0] != kFilterNone && row[0] != kFilterUp) return std::nullopt;
    for (std::size_t x = 0; x < width; ++x) {
      const char above = row[0] == kFilterUp && y > 0 ? samples[samples.size() - width] : '\0';
      samples += static_cast<char>(row[1 + x] + above);
    }
  }
  return samples;
}

std::string to_png(const Picture& picture, int level) {
  constexpr char kRgb = 2;
  std::string png(kSignature);
  append_chunk(png, "IHDR",
               header_of(static_cast<std::uint32_t>(picture.width), static_cast<std::uint32_t>(picture.height), kRgb));
  append_chunk(png, "IDAT", deflated(filtered_rows(picture), level));
  append_chunk(png, "IEND", {});
  return png;
}

void require_png_name(const std::string& output) {
  if (output.ends_with(".png")) return;
  throw UsageError("--output is a PNG file: give it a name that ends with .png, not '" + output + "'");
}

}  // namespace ccslice::cli
