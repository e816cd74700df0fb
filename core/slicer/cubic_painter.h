// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sets voxels of a layer to what cubic polynomials of their place say.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/material/tile_polynomial.h"
#include "core/slicer/interpolation_spec.h"
#include "core/slicer/layer_target.h"

namespace ccslice {

class CubicPainter {
 public:
  /// REQUIRES: target outlives the painter; each of its planes shows one of the channels.
  CubicPainter(const LayerTarget& target, std::uint32_t layer, std::span<const ChannelTolerance> channels);

  /// Those of the voxels [begin, end) of a row that the planes hold; counts them as interpolated. `polynomials`: one a
  /// channel.
  void paint(const TileFrame& frame, std::span<const CubicPolynomial> polynomials, std::uint32_t row,
             std::uint32_t begin, std::uint32_t end) const;

 private:
  const LayerTarget& target_;
  std::uint32_t layer_;
  std::vector<std::size_t> channel_of_plane_;
};

}  // namespace ccslice
