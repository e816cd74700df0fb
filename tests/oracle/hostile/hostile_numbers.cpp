// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_numbers.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "core/output/region_colours.h"
#include "tests/core/output/tiny_png.h"

namespace ccslice::oracle {
namespace {

std::size_t bits_of(SampleType type) {
  switch (type) {
    case SampleType::kBit: return 1;
    case SampleType::kUint2: return 2;
    case SampleType::kUint4: return 4;
    default: return 8;
  }
}

/// Most significant bits first, rows of whole bytes.
std::vector<std::uint8_t> unpacked(std::span<const std::uint8_t> packed, std::size_t bits, const GridExtent& extent) {
  const std::size_t row_bytes = (extent.columns * bits + 7) / 8;
  if (packed.size() != row_bytes * extent.rows) throw std::runtime_error("a plane of another size");
  std::vector<std::uint8_t> numbers;
  numbers.reserve(std::size_t{extent.columns} * extent.rows);
  for (std::uint32_t row = 0; row < extent.rows; ++row) {
    for (std::uint32_t column = 0; column < extent.columns; ++column) {
      const std::size_t bit = column * bits;
      const unsigned byte = packed[row * row_bytes + bit / 8];
      numbers.push_back(static_cast<std::uint8_t>(byte >> (8 - bits - bit % 8) & ((1u << bits) - 1)));
    }
  }
  return numbers;
}

std::uint8_t number_of_colour(std::uint32_t rgba, std::span<const std::uint32_t> palette) {
  const auto place = std::ranges::find(palette, rgba);
  if (place == palette.end()) throw std::runtime_error("a colour that the palette hasn't");
  return static_cast<std::uint8_t>(place - palette.begin());
}

/// Indexed, RGBA or black and white. Indexed files may number their colours as they like.
std::vector<std::uint8_t> numbers_of_png(const TinyPng& png, const GridExtent& extent,
                                         std::span<const std::uint32_t> palette) {
  if (png.width != extent.columns || png.height != extent.rows) throw std::runtime_error("a picture of another size");
  const auto colour = [](const std::uint8_t* rgb, std::uint32_t alpha) {
    return std::uint32_t{rgb[0]} << 24 | std::uint32_t{rgb[1]} << 16 | std::uint32_t{rgb[2]} << 8 | alpha;
  };
  std::vector<std::uint8_t> numbers;
  if (png.color_type == 6) {
    for (std::size_t i = 0; i < png.samples.size(); i += 4) {
      numbers.push_back(number_of_colour(colour(&png.samples[i], png.samples[i + 3]), palette));
    }
    return numbers;
  }
  numbers = unpacked(png.samples, static_cast<std::size_t>(png.bit_depth), extent);
  for (std::uint8_t& number : numbers) {
    if (png.color_type == 3) {
      const std::uint32_t alpha = number < png.alphas.size() ? png.alphas[number] : 255;
      number = number_of_colour(colour(&png.palette.at(std::size_t{number} * 3), alpha), palette);
    } else {
      number = number > 0 ? 1 : 0;
    }
  }
  return numbers;
}

}  // namespace

bool shows_numbers(const PlaneSpec& plane) {
  return plane.content != PlaneContent::kChannel && plane.content != PlaneContent::kChannels;
}

std::vector<std::uint8_t> numbers_of(const PlaneSpec& plane, const EncodedPlane& encoded, const GridExtent& extent,
                                     std::span<const std::uint32_t> palette) {
  if (plane.encoding == Encoding::kRaw) return unpacked(encoded.bytes, bits_of(plane.sample_type), extent);
  return numbers_of_png(read_tiny_png(encoded.bytes), extent, palette);
}

std::vector<std::uint8_t> packed_numbers(std::span<const std::uint8_t> numbers, SampleType type,
                                         const GridExtent& extent) {
  const std::size_t bits = bits_of(type), row_bytes = (extent.columns * bits + 7) / 8;
  std::vector<std::uint8_t> packed(row_bytes * extent.rows);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t bit = i % extent.columns * bits;
    packed[i / extent.columns * row_bytes + bit / 8] |= static_cast<std::uint8_t>(numbers[i] << (8 - bits - bit % 8));
  }
  return packed;
}

std::vector<std::uint32_t> palette_of_plane(const SliceJob& job, const PlaneSpec& plane, std::size_t cell_regions) {
  if (plane.content == PlaneContent::kCellRegions) return region_palette(cell_regions);
  if (plane.content == PlaneContent::kMaterials) return palette_of(*job.printing);
  return {};
}

}  // namespace ccslice::oracle
