// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Rows of an image whose samples may be a window of it.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/output/plane.h"

namespace ccslice {

class SampleRows {
 public:
  /// REQUIRES: the image outlives this.
  explicit SampleRows(const SampleImage& image);

  /// Row y, as wide as the image. Valid until the next call.
  std::span<const std::uint8_t> operator()(std::uint32_t y);
  /// A row that the window holds nothing of.
  std::span<const std::uint8_t> outside() const { return outside_; }

 private:
  const SampleImage& image_;
  const LayerWindow window_;
  const std::size_t voxel_bits_, window_bytes_;  // The latter of a row of the window.
  std::vector<std::uint8_t> outside_, row_;
};

}  // namespace ccslice
