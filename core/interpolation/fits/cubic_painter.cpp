// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/cubic_painter.h"

#include <algorithm>
#include <limits>

namespace ccslice {

void LayerCubics::reduce(std::uint32_t index, const VoxelFrame& frame, std::span<const CubicPolynomial> polynomials,
                         std::uint32_t layer) {
  if (layers_.size() <= index) {
    layers_.resize(index + std::size_t{1}, std::numeric_limits<std::uint32_t>::max());
    cubics_.resize(layers_.size() * polynomials.size());
  }
  layers_[index] = layer;
  const double z = (layer - frame.centre.z()) * frame.scale.z();
  CubicInLayer* cubics = &cubics_[index * polynomials.size()];
  for (const CubicPolynomial& polynomial : polynomials) *cubics++ = in_layer(polynomial, z);
}

CubicPainter::CubicPainter(const LayerTarget& target, std::uint32_t layer, std::span<const ChannelTolerance> channels)
    : target_(target), layer_(layer) {
  for (std::size_t p = 0; p < target.planes.size(); ++p) {
    const auto found = std::ranges::find_if(
        channels, [&](const ChannelTolerance& c) { return c.channel == target.planes[p].channel(); });
    if (found != channels.end()) planes_.push_back({p, static_cast<std::size_t>(found - channels.begin())});
  }
}

}  // namespace ccslice
