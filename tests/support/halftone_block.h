// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A box of voxels, halftoned from values of one channel: what tests and benches of halftones look at.

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/printing/halftone.h"
#include "tests/support/power_spectrum.h"

namespace ccslice {

/// Materials a, b, ... of different greys, blended along channel 0 from value 0 on, each at a whole number.
inline Printing blend_of(std::size_t materials, HalftoneMethod method, std::uint64_t seed = 0) {
  Printing printing;
  BlendMap blend;
  blend.channel = "0";
  for (std::uint32_t m = 0; m < materials; ++m) {
    printing.materials.push_back({std::string(1, static_cast<char>('a' + m)), 0x10101000u * (m + 1) + 0xff});
    blend.stops.push_back({static_cast<double>(m), m + 1});
  }
  if (materials > 1) printing.map.kind = blend;
  printing.halftone = {method, seed};
  return printing;
}

/// Materials a, b, ... whose fractions are channels 0, 1, ...
inline Printing shares_of(std::size_t materials, HalftoneMethod method, std::uint64_t seed = 0) {
  Printing printing = blend_of(materials, method, seed);
  DirectMap direct;
  for (std::uint32_t m = 0; m < materials; ++m) direct.shares.push_back({std::to_string(m), m + 1});
  printing.map.kind = direct;
  return printing;
}

struct HalftonedBlock {
  std::array<std::size_t, 3> size;  // Along x, y, z.
  std::array<double, 3> pitch_mm;
  std::vector<std::uint8_t> materials;  // By z, y, x.

  std::uint8_t at(std::size_t x, std::size_t y, std::size_t z) const {
    return materials[(z * size[1] + y) * size[0] + x];
  }

  VoxelPattern pattern(std::uint8_t material) const {
    VoxelPattern result{size, pitch_mm, {}};
    for (const std::uint8_t m : materials) result.values.push_back(m == material ? 1.0f : 0.0f);
    return result;
  }
};

/// All of layers [first_layer, first_layer + size[2]) filled; `values(x, y, z)` gives the channels that the map reads.
inline HalftonedBlock halftone_block(
    const HalftonePlan& plan, const std::array<double, 3>& pitch_mm, const std::array<std::size_t, 3>& size,
    const std::function<std::vector<float>(std::size_t, std::size_t, std::size_t)>& values,
    std::uint32_t first_layer = 0) {
  HalftonedBlock block{size, pitch_mm, std::vector<std::uint8_t>(size[0] * size[1] * size[2])};
  Halftoner halftoner(plan);
  std::vector<MixRow> rows(plan.mixtures().front().channels().size());
  Fractions fractions{};
  const std::size_t blocks = (size[0] + kMixBlock - 1) / kMixBlock;
  for (std::size_t z = 0; z < size[2]; ++z) {
    halftoner.start_layer(static_cast<std::uint32_t>(size[0]), first_layer + static_cast<std::uint32_t>(z));
    for (std::size_t y = 0; y < size[1]; ++y) {
      halftoner.start_row(static_cast<std::uint32_t>(y));
      for (std::size_t i = 0; i < blocks; ++i) {
        const std::size_t b = halftoner.reverse() ? blocks - 1 - i : i, left = b * kMixBlock;
        const std::size_t end = std::min(size[0] - left, kMixBlock);
        for (std::size_t k = 0; k < end; ++k) {
          const std::vector<float> voxel = values(left + k, y, first_layer + z);
          for (std::size_t c = 0; c < rows.size(); ++c) rows[c][k] = voxel[c];
        }
        plan.mixtures().front().evaluate(rows, fractions);
        halftoner.choose(static_cast<std::uint32_t>(b), 0, static_cast<std::uint32_t>(end), fractions,
                         &block.materials[(z * size[1] + y) * size[0] + left]);
      }
    }
  }
  return block;
}

}  // namespace ccslice
