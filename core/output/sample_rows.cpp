// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/sample_rows.h"

#include <algorithm>

#include "core/output/arrange.h"
#include "core/output/pack_indices.h"
#include "core/output/plane.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kByte = 8;

}  // namespace

SampleRows::SampleRows(const SampleImage& image)
    : image_(image),
      window_(image_window(image)),
      voxel_bits_(channel_count(image) * sample_bytes(image.type, kByte, 1)),
      window_bytes_(sample_bytes(image.type, window_.columns, 1, channel_count(image))),
      outside_(sample_bytes(image.type, image.width, 1, channel_count(image))) {
  const std::size_t sample = std::max<std::size_t>(1, sample_bytes(image.type, kByte, 1) / kByte);
  fill_samples(outside_, std::span(image.outside).first(sample));
}

std::span<const std::uint8_t> SampleRows::operator()(std::uint32_t y) {
  if (y < window_.first_row || y >= window_.end_row()) return outside_;
  const std::span<const std::uint8_t> held =
      image_.samples.subspan(window_bytes_ * (y - window_.first_row), window_bytes_);
  if (!image_.window) return held;
  row_ = outside_;
  copy_bits(held.data(), 0, voxel_bits_ * window_.columns, row_.data(), voxel_bits_ * window_.first_column);
  return row_;
}

}  // namespace ccslice
