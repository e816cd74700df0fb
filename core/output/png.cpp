// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/png.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "core/output/pack_indices.h"
#include "core/output/plane.h"
#include "core/output/polling.h"
#include "core/output/sample_rows.h"

namespace ccslice {
namespace {

constexpr std::uint8_t kGrey = 0, kIndexed = 3, kGreyAlpha = 4, kRgba = 6;  // Colour types.
constexpr std::uint8_t kFilterNone = 0, kFilterUp = 2;                      // Filter types.

void put_number(std::uint32_t number, std::vector<std::uint8_t>& out) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(number >> shift));
}

void put_chunk(std::string_view type, std::span<const std::uint8_t> data, std::vector<std::uint8_t>& out) {
  put_number(static_cast<std::uint32_t>(data.size()), out);
  const std::size_t begin = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), data.begin(), data.end());
  put_number(libdeflate_crc32(0, out.data() + begin, out.size() - begin), out);
}

/// Pixels a metre, of which PNG has whole ones.
std::uint32_t pixels_a_metre(double pitch_mm) {
  constexpr double kMetreMm = 1000, kMost = std::numeric_limits<std::int32_t>::max();  // PNG's own limit.
  return static_cast<std::uint32_t>(std::clamp(std::round(kMetreMm / pitch_mm), 1.0, kMost));
}

void put_resolution(const PixelPitch& pitch, std::vector<std::uint8_t>& file) {
  if (pitch.x_mm <= 0 || pitch.y_mm <= 0) return;
  constexpr std::uint8_t kMetre = 1;
  std::vector<std::uint8_t> data;
  put_number(pixels_a_metre(pitch.x_mm), data);
  put_number(pixels_a_metre(pitch.y_mm), data);
  data.push_back(kMetre);
  put_chunk("pHYs", data, file);
}

/// Signature, IHDR and pHYs, for an image of either kind.
template <typename Image>
std::vector<std::uint8_t> begin_file(const Image& image, std::uint32_t bits, std::uint8_t colour_type) {
  std::vector<std::uint8_t> file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  std::vector<std::uint8_t> header;
  put_number(image.width, header);
  put_number(image.height, header);
  // Deflate, filters by row, not interlaced.
  header.insert(header.end(), {static_cast<std::uint8_t>(bits), colour_type, 0, 0, 0});
  put_chunk("IHDR", header, file);
  put_resolution(image.pitch, file);
  return file;
}

std::vector<std::uint8_t> end_file(std::vector<std::uint8_t> file, std::span<const std::uint8_t> picture) {
  file.reserve(file.size() + picture.size() + 24);
  put_chunk("IDAT", picture, file);
  put_chunk("IEND", {}, file);
  return file;
}

Colour colour_of(std::uint32_t rgba) {
  return {static_cast<std::uint8_t>(rgba >> 24), static_cast<std::uint8_t>(rgba >> 16),
          static_cast<std::uint8_t>(rgba >> 8), static_cast<std::uint8_t>(rgba)};
}

void put_palette(std::span<const std::uint32_t> palette, std::vector<std::uint8_t>& file) {
  std::vector<std::uint8_t> colours, alphas;
  for (const std::uint32_t rgba : palette) {
    const Colour colour = colour_of(rgba);
    colours.insert(colours.end(), colour.begin(), colour.begin() + 3);
    alphas.push_back(colour[3]);
  }
  put_chunk("PLTE", colours, file);
  if (std::ranges::any_of(alphas, [](std::uint8_t alpha) { return alpha != 255; })) put_chunk("tRNS", alphas, file);
}

std::size_t png_row_bytes(const SampleImage& image) {
  return image.type == SampleType::kUint16 ? std::size_t{image.width} * 2 : image.width;
}

/// Fewer bytes of equal rows are rows like others.
constexpr std::uint64_t kFewestEqual = 1 << 16;

/// Calls append_row(y) for rows in order, and append_equal(rows) for many rows outside the window together.
/// `row_bytes`: of the file. `can_be_equal`: append_equal() can do what is outside.
template <typename Image, typename AppendRow, typename AppendEqual>
void append_all_rows(const Image& image, std::uint64_t row_bytes, bool can_be_equal, const CancellationToken& cancel,
                     const AppendRow& append_row, const AppendEqual& append_equal) {
  const std::uint32_t first = image_window(image).first_row, end = image_window(image).end_row();
  const auto is_long = [&](std::uint32_t rows) { return can_be_equal && rows * row_bytes >= kFewestEqual; };
  std::uint32_t y = 0, last = image.height;
  if (is_long(first)) {
    append_equal(first);
    y = first;
  }
  if (is_long(image.height - end)) last = end;
  for (; y < last; ++y) {
    if (y % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    append_row(y);
  }
  if (last < image.height) append_equal(image.height - last);
}

bool is_zero(const std::array<std::uint8_t, 4>& sample) {
  return std::ranges::all_of(sample, [](std::uint8_t byte) { return byte == 0; });
}

/// A row as PNG's samples of 8 or 16 bits.
void spread_row(SampleType type, const std::uint8_t* in, std::span<std::uint8_t> out) {
  switch (type) {
    case SampleType::kBit:
      for (std::size_t x = 0; x < out.size(); ++x) out[x] = in[x / 8] >> (7 - x % 8) & 1 ? 255 : 0;
      break;
    case SampleType::kUint16:  // PNG has the high byte first.
      for (std::size_t i = 0; i < out.size(); ++i) out[i] = in[i ^ 1];
      break;
    default: std::copy_n(in, out.size(), out.begin());
  }
}

struct FewColours {
  std::vector<std::uint32_t> palette;  // 0xRRGGBBAA.
  std::vector<std::uint8_t> indices;
};

/// Numbers of the pixels' colours, unless there are more than 256.
std::optional<FewColours> few_colours(std::span<const std::uint8_t> rgba) {
  constexpr std::size_t kMost = 256, kSlots = 1024;
  constexpr std::uint32_t kSpread = 0x9e3779b1;  // 2^32 over the golden ratio.
  constexpr int kSlotShift = 22;                 // Leaves 10 bits.
  FewColours found;
  found.indices.resize(rgba.size() / 4);
  std::array<std::uint16_t, kSlots> slots{};  // 1 + the colour's number; 0 if the slot is free.
  std::uint32_t last = 0;
  std::uint8_t number = 0;
  for (std::size_t pixel = 0; pixel < found.indices.size(); ++pixel) {
    const std::uint8_t* bytes = &rgba[4 * pixel];
    const std::uint32_t colour = std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
                                 std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]};
    if (colour != last || found.palette.empty()) {
      std::size_t slot = colour * kSpread >> kSlotShift;
      while (slots[slot] != 0 && found.palette[slots[slot] - 1u] != colour) slot = (slot + 1) % kSlots;
      if (slots[slot] == 0) {
        if (found.palette.size() == kMost) return std::nullopt;
        found.palette.push_back(colour);
        slots[slot] = static_cast<std::uint16_t>(found.palette.size());
      }
      number = static_cast<std::uint8_t>(slots[slot] - 1);
      last = colour;
    }
    found.indices[pixel] = number;
  }
  return found;
}

}  // namespace

/// Rows as the differences to those above. spread(y, row) writes row y.
template <typename Image, typename Spread>
void PngEncoder::append_rows(const Image& image, std::size_t row_bytes, bool zeros_outside,
                             const CancellationToken& cancel, Spread&& spread) {
  above_.assign(row_bytes, 0);
  std::vector<std::uint8_t> here(row_bytes);
  row_.resize(1 + row_bytes);
  row_[0] = kFilterUp;
  stream_.start_bytes();
  const auto append_row = [&](std::uint32_t y) {
    spread(y, std::span(here));
    for (std::size_t i = 0; i < row_bytes; ++i) row_[1 + i] = static_cast<std::uint8_t>(here[i] - above_[i]);
    stream_.append(row_);
    std::swap(here, above_);
  };
  // Rows of zeros are what they are, not differences.
  static_assert(kFilterNone == 0);
  append_all_rows(image, 1 + row_bytes, zeros_outside, cancel, append_row, [&](std::uint32_t rows) {
    stream_.append_equal_rows(rows, 1 + row_bytes, 0);
    std::ranges::fill(above_, std::uint8_t{0});
  });
}

std::vector<std::uint8_t> PngEncoder::grey(const SampleImage& image, const CancellationToken& cancel) {
  SampleRows rows(image);
  append_rows(image, png_row_bytes(image), is_zero(image.outside), cancel,
              [&](std::uint32_t y, std::span<std::uint8_t> row) { spread_row(image.type, rows(y).data(), row); });
  return end_file(begin_file(image, image.type == SampleType::kUint16 ? 16 : 8, kGrey), stream_.finish());
}

std::vector<std::uint8_t> PngEncoder::grey_alpha(const SampleImage& image, const CancellationToken& cancel) {
  const std::size_t grey_bytes = png_row_bytes(image), bytes = grey_bytes / image.width;
  std::vector<std::uint8_t> grey(grey_bytes);
  SampleRows rows(image);
  append_rows(image, 2 * grey_bytes, is_zero(image.outside), cancel, [&](std::uint32_t y, std::span<std::uint8_t> row) {
    spread_row(image.type, rows(y).data(), grey);
    const std::uint8_t* inside = image.inside.data() + image.inside.size() / image.height * y;
    for (std::size_t x = 0; x < image.width; ++x) {
      std::copy_n(&grey[bytes * x], bytes, &row[2 * bytes * x]);
      std::fill_n(&row[2 * bytes * x + bytes], bytes, inside[x / 8] >> (7 - x % 8) & 1 ? 255 : 0);
    }
  });
  return end_file(begin_file(image, image.type == SampleType::kUint16 ? 16 : 8, kGreyAlpha), stream_.finish());
}

void PngEncoder::append_plain_rows(const SampleImage& image, const CancellationToken& cancel) {
  constexpr std::uint8_t kFilter[] = {kFilterNone};
  const std::size_t row_bytes = sample_bytes(image.type, image.width, 1);
  SampleRows row(image);
  stream_.start_bytes();
  append_all_rows(
      image, 1 + row_bytes, is_zero(image.outside), cancel,
      [&](std::uint32_t y) {
        stream_.append(kFilter);
        stream_.append(row(y));
      },
      [&](std::uint32_t rows) { stream_.append_equal_rows(rows, 1 + row_bytes, 0); });
}

std::vector<std::uint8_t> PngEncoder::bitmap(const SampleImage& image, const CancellationToken& cancel) {
  append_plain_rows(image, cancel);
  return end_file(begin_file(image, 1, kGrey), stream_.finish());
}

std::vector<std::uint8_t> PngEncoder::indexed(const SampleImage& image, std::span<const std::uint32_t> palette,
                                              const CancellationToken& cancel) {
  append_plain_rows(image, cancel);
  std::vector<std::uint8_t> file = begin_file(image, bits_per_index(image.type), kIndexed);
  put_palette(palette, file);
  return end_file(std::move(file), stream_.finish());
}

std::vector<std::uint8_t> PngEncoder::colours(std::uint32_t width, std::uint32_t height,
                                              std::span<const std::uint8_t> rgba, const CancellationToken& cancel) {
  if (const auto few = few_colours(rgba)) {
    return indexed({SampleType::kUint8, width, height, few->indices}, few->palette, cancel);
  }
  return true_colours(width, height, rgba, cancel);
}

std::vector<std::uint8_t> PngEncoder::true_colours(std::uint32_t width, std::uint32_t height,
                                                   std::span<const std::uint8_t> rgba,
                                                   const CancellationToken& cancel) {
  const std::size_t row_bytes = std::size_t{4} * width;
  const IndexImage image{width, height, {}, {}};
  append_rows(image, row_bytes, false, cancel, [&](std::uint32_t y, std::span<std::uint8_t> row) {
    std::copy_n(&rgba[row_bytes * y], row_bytes, row.begin());
  });
  return end_file(begin_file(image, 8, kRgba), stream_.finish());
}

std::vector<std::uint8_t> PngEncoder::rgba(const IndexImage& image, const CancellationToken& cancel) {
  std::array<Colour, kMostRgbaColours> palette;
  std::ranges::transform(image.palette, palette.begin(), colour_of);
  constexpr std::uint8_t kFilter[] = {ZlibStream::kSeparator};
  const std::size_t row_units = std::size_t{1} + image.width;
  stream_.start_colours(std::span(palette).first(image.palette.size()), row_units);
  const LayerWindow window = image_window(image);
  const std::vector<std::uint8_t> background(image.width);
  append_all_rows(
      image, 1 + std::uint64_t{4} * image.width, true, cancel,
      [&](std::uint32_t y) {
        stream_.append(kFilter);
        if (y < window.first_row || y >= window.end_row()) return stream_.append(background);
        const std::size_t row = std::size_t{window.columns} * (y - window.first_row);
        stream_.append(std::span(background).first(window.first_column));
        stream_.append(image.indices.subspan(row, window.columns));
        stream_.append(std::span(background).subspan(window.first_column + window.columns));
      },
      [&](std::uint32_t rows) { stream_.append_equal_rows(rows, row_units, 0); });
  return end_file(begin_file(image, 8, kRgba), stream_.finish());
}

}  // namespace ccslice
