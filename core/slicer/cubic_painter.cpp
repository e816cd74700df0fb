// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cubic_painter.h"

#include <algorithm>

namespace ccslice {

CubicPainter::CubicPainter(const LayerTarget& target, std::uint32_t layer, std::span<const ChannelTolerance> channels)
    : target_(target), layer_(layer) {
  for (const ContonePlane& plane : target.planes) {
    const auto found = std::find_if(channels.begin(), channels.end(),
                                    [&](const ChannelTolerance& c) { return c.channel == plane.channel(); });
    channel_of_plane_.push_back(static_cast<std::size_t>(found - channels.begin()));
  }
}

void CubicPainter::paint(const TileFrame& frame, std::span<const CubicPolynomial> polynomials, std::uint32_t row,
                         std::uint32_t begin, std::uint32_t end) const {
  const Span part = target_.window.clipped({row, begin, end});
  if (part.begin == part.end) return;
  const Vec3 at = frame(Vec3(begin, row, layer_));
  const std::size_t index = target_.window.index(part.begin, row);
  for (std::size_t p = 0; p < channel_of_plane_.size(); ++p) {
    target_.planes[p].set_cubic(index, part.begin - begin, part.end - part.begin, at.x(), frame.scale.x(),
                                along_row(polynomials[channel_of_plane_[p]], at.y(), at.z()));
  }
  target_.stats.voxels_interpolated += target_.count(part);
}

}  // namespace ccslice
