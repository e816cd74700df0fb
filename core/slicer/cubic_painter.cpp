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

}  // namespace ccslice
