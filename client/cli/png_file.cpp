// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/png_file.h"

#include <libdeflate.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string_view>

namespace ccslice::cli {
namespace {

constexpr std::size_t kComponents = 3;
constexpr char kFilterUp = 2;

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

std::string deflated(const std::string& bytes) {
  constexpr int kLevel = 9;
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string packed(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  packed.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), packed.data(), packed.size()));
  return packed;
}

}  // namespace

std::string to_png(const Picture& picture) {
  std::string header;
  append_number(header, static_cast<std::size_t>(picture.width));
  append_number(header, static_cast<std::size_t>(picture.height));
  header += {'\x08', '\x02', '\0', '\0', '\0'};  // 8 bits, RGB, deflate, adaptive filters, not interlaced.
  std::string png = "\x89PNG\r\n\x1a\n";
  append_chunk(png, "IHDR", header);
  append_chunk(png, "IDAT", deflated(filtered_rows(picture)));
  append_chunk(png, "IEND", {});
  return png;
}

}  // namespace ccslice::cli
