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

  /// Those of the voxels [begin, end) of a row that the planes hold; counts them as interpolated. `along(c, y, z)`: the
  /// c-th channel's polynomial along a row in the frame.
  template <typename Along>
  void paint(const TileFrame& frame, std::uint32_t row, std::uint32_t begin, std::uint32_t end, Along along) const {
    const Span part = target_.window.clipped({row, begin, end});
    if (part.begin == part.end) return;
    const Vec3 at = frame(Vec3(begin, row, layer_));
    const std::size_t index = target_.window.index(part.begin, row);
    for (std::size_t p = 0; p < channel_of_plane_.size(); ++p) {
      target_.planes[p].set_cubic(index, part.begin - begin, part.end - part.begin, at.x(), frame.scale.x(),
                                  along(channel_of_plane_[p], at.y(), at.z()));
    }
    target_.stats.voxels_interpolated += target_.count(part);
  }

 private:
  const LayerTarget& target_;
  std::uint32_t layer_;
  std::vector<std::size_t> channel_of_plane_;
};

}  // namespace ccslice
