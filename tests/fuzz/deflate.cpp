// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What our deflate makes of arbitrary bytes and of rows of colours, in pieces: zlib inflates it to the same.
//
// Byte 0: its remainder by 17 is the number of colours, or 0 for bytes. Byte 1: the largest piece, and the length of a
// row of colours. The rest, up to eight times over, is the data.

#include "core/output/deflate.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "tests/fuzz/byte_reader.h"

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes inflated(const Bytes& stream, std::size_t size) {
  Bytes bytes(size + 1);
  uLongf found = bytes.size();
  if (uncompress(bytes.data(), &found, stream.data(), stream.size()) != Z_OK) std::abort();
  bytes.resize(found);
  return bytes;
}

/// Appends the units in pieces of 1, 2, 3 and so on up to `largest`, again and again.
Bytes finished(ccslice::ZlibStream& stream, std::span<const std::uint8_t> units, std::size_t largest) {
  for (std::size_t piece = 1; !units.empty(); piece = piece % largest + 1) {
    const std::size_t count = std::min(piece, units.size());
    stream.append(units.first(count));
    units = units.subspan(count);
  }
  return stream.finish();
}

void check_bytes(const Bytes& bytes, std::size_t largest) {
  ccslice::ZlibStream stream;
  stream.start_bytes();
  if (inflated(finished(stream, bytes, largest), bytes.size()) != bytes) std::abort();
}

void check_colours(const Bytes& indices, std::size_t colours, std::size_t row) {
  std::vector<ccslice::Colour> palette;
  for (std::size_t i = 0; i < colours; ++i) {
    const auto value = static_cast<std::uint8_t>(i * 37);
    palette.push_back({value, static_cast<std::uint8_t>(value ^ 0x5a), static_cast<std::uint8_t>(i / 3), 255});
  }
  Bytes units, bytes;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (i % row == 0) {
      units.push_back(ccslice::ZlibStream::kSeparator);
      bytes.push_back(0);
    }
    const std::size_t index = indices[i] % colours;
    units.push_back(static_cast<std::uint8_t>(index));
    bytes.insert(bytes.end(), palette[index].begin(), palette[index].end());
  }
  ccslice::ZlibStream stream;
  stream.start_colours(palette, row + 1);
  if (inflated(finished(stream, units, row), bytes.size()) != bytes) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ccslice::fuzz::ByteReader reader(data, size);
  const std::size_t colours = reader.next() % (1 + ccslice::ZlibStream::kMostColours);
  const std::size_t row = std::size_t{1} + reader.next();
  const std::string rest = reader.rest();
  if (rest.empty()) return 0;
  Bytes bytes;
  const std::size_t copies = 1 + static_cast<std::uint8_t>(rest.front()) % 8;
  for (std::size_t copy = 0; copy < copies; ++copy) bytes.insert(bytes.end(), rest.begin(), rest.end());
  if (colours == 0) {
    check_bytes(bytes, row);
  } else {
    check_colours(bytes, colours, row);
  }
  return 0;
}
