// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limits that keep one request from taking a server's memory or days of its time. A server's options may change them.

#pragma once

#include <cstdint>

namespace ccslice {

/// What a slicing request may ask for at most.
struct SliceLimits {
  std::uint32_t max_columns = 65'536;
  std::uint32_t max_rows = 65'536;
  std::uint32_t max_layers = 1'000'000;
  std::uint64_t max_voxels_per_layer = 256ull << 20;
  std::uint64_t max_layer_bytes = 2ull << 30;  // Samples of all planes of a layer before encoding.
  double min_pitch_mm = 1e-4;
  double max_pitch_mm = 1e3;
  double min_contour_tolerance_mm = 1e-5;
  double max_contour_tolerance_mm = 1.0;
  double max_channel_tolerance = 1.0;  // Share of a plane's value range. The smallest is 0.
  double max_abs_coordinate_mm = 1e7;  // For the placed part and the origin: doubles resolve 2 nm there.
  double min_placement_scale = 1e-6;
  double max_placement_scale = 1e6;
  std::uint32_t max_planes = 64;  // Pictures per layer: occupancy and channels.
};

}  // namespace ccslice
