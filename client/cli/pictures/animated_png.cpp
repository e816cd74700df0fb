// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/animated_png.h"

#include <libdeflate.h>

#include <string_view>

namespace ccslice::cli {
namespace {

constexpr std::size_t kSignatureBytes = 8, kPngNumberBytes = 4, kTypeBytes = 4;

void put(std::uint32_t number, std::string& out) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(number >> shift);
}

void put(std::uint16_t number, std::string& out) {
  out += static_cast<char>(number >> 8);
  out += static_cast<char>(number);
}

std::uint32_t number_at(std::string_view bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < kPngNumberBytes; ++i) number = number << 8 | static_cast<std::uint8_t>(bytes[i]);
  return number;
}

void put_chunk(std::string_view type, std::string_view data, std::string& out) {
  put(static_cast<std::uint32_t>(data.size()), out);
  const std::size_t begin = out.size();
  out += type;
  out += data;
  put(libdeflate_crc32(0, out.data() + begin, out.size() - begin), out);
}

/// Calls take(type, data) for the chunks of a file.
template <typename Take>
void for_chunks(std::string_view file, const Take& take) {
  file.remove_prefix(kSignatureBytes);
  while (!file.empty()) {
    const std::size_t size = number_at(file);
    take(file.substr(kPngNumberBytes, kTypeBytes), file.substr(kPngNumberBytes + kTypeBytes, size));
    file.remove_prefix(2 * kPngNumberBytes + kTypeBytes + size);
  }
}

std::string frame_control(std::uint32_t sequence, std::string_view size, std::uint16_t frame_ms) {
  constexpr std::uint16_t kPartsOfASecond = 1000;
  std::string data;
  put(sequence, data);
  data += size;
  put(std::uint32_t{0}, data);  // Where the frame lies: all of the picture.
  put(std::uint32_t{0}, data);
  put(frame_ms, data);
  put(kPartsOfASecond, data);
  data += '\0';  // It stays until the next one,
  data += '\0';  // which replaces it, transparent pixels too.
  return data;
}

}  // namespace

std::string animated_png(std::span<const std::string> frames, std::uint16_t frame_ms) {
  std::string file(frames.front(), 0, kSignatureBytes);
  std::uint32_t sequence = 0;
  std::string size;  // Width and height, as the header has them.
  for (const std::string& frame : frames) {
    const bool first = &frame == &frames.front();
    for_chunks(frame, [&](std::string_view type, std::string_view data) {
      if (type == "IHDR" && first) {
        put_chunk(type, data, file);
        size = data.substr(0, 2 * kPngNumberBytes);
        std::string control;
        put(static_cast<std::uint32_t>(frames.size()), control);
        put(std::uint32_t{0}, control);  // For ever.
        put_chunk("acTL", control, file);
      } else if (type == "IDAT") {
        put_chunk("fcTL", frame_control(sequence++, size, frame_ms), file);
        if (first) return put_chunk(type, data, file);
        std::string numbered;
        put(sequence++, numbered);
        numbered += data;
        put_chunk("fdAT", numbered, file);
      }
    });
  }
  put_chunk("IEND", {}, file);
  return file;
}

}  // namespace ccslice::cli
