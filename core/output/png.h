// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// PNG files (ISO/IEC 15948) of layers, row 0 on top. They hold the picture, its resolution (pHYs, where the pitch is
// known) and nothing else: no date, gamma or program, so equal layers are equal files, on every machine (deflate.h).
//
//   grey    8 and 16 bits: each row as its difference to the row above, which graded channels make small; 1 bit: as it
//   is; indexed 1, 2, 4 or 8 bits with PLTE, and tRNS if a colour isn't opaque: as it is; RGBA    8 bits a component:
//   as it is.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/output/deflate.h"
#include "core/output/plane.h"

namespace ccslice {

/// One thread's encoder: keeps scratch memory from picture to picture. All functions poll `cancel` every few rows and
/// throw Error{kCancelled}.
/// Images may be windows: many rows that these hold nothing of cost next to nothing.
class PngEncoder {
 public:
  static constexpr std::size_t kMostRgbaColours = ZlibStream::kMostColours;

  /// kBit becomes 8 bits, 0 or 255. REQUIRES: kBit, kUint8 or kUint16, one sample a voxel.
  std::vector<std::uint8_t> grey(const SampleImage& image, const CancellationToken& cancel);
  /// Each sample with its alpha. REQUIRES: kUint8 or kUint16, one sample a voxel, image.inside.
  std::vector<std::uint8_t> grey_alpha(const SampleImage& image, const CancellationToken& cancel);
  /// REQUIRES: kBit. One bit a voxel.
  std::vector<std::uint8_t> bitmap(const SampleImage& image, const CancellationToken& cancel);
  /// `image`: packed numbers, all within the palette of 0xRRGGBBAA. REQUIRES: as many colours as their bits hold at
  /// most.
  std::vector<std::uint8_t> indexed(const SampleImage& image, std::span<const std::uint32_t> palette,
                                    const CancellationToken& cancel);
  /// Any colours: 4 bytes a pixel. With a palette where there are at most 256 of them, which takes a quarter of the
  /// time and of the bytes. REQUIRES: width * height of them.
  std::vector<std::uint8_t> colours(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgba,
                                    const CancellationToken& cancel);
  /// The same, always without a palette.
  std::vector<std::uint8_t> true_colours(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgba,
                                         const CancellationToken& cancel);
  /// REQUIRES: numbers within the palette, of at most kMostRgbaColours.
  std::vector<std::uint8_t> rgba(const IndexImage& image, const CancellationToken& cancel);

 private:
  template <typename Image, typename Spread>
  void append_rows(const Image& image, std::size_t row_bytes, bool zeros_outside, const CancellationToken& cancel,
                   Spread&& spread);
  void append_plain_rows(const SampleImage& image, const CancellationToken& cancel);

  ZlibStream stream_;
  std::vector<std::uint8_t> row_, above_;
};

}  // namespace ccslice
