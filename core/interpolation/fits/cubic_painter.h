// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sets voxels of a layer to what cubic polynomials of their place say.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/prefetch.h"
#include "core/field/layer_target.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"

namespace ccslice {

/// The cubics of a slab's pieces or tiles in the layer at hand, which most rows of one share. Memory is kept.
class LayerCubics {
 public:
  /// Forgets all.
  void clear() { layers_.clear(); }
  /// One a polynomial: those of number `index`, which comes with the same frame and polynomials each time, and with as
  /// many as any other. Valid until the next call.
  const CubicInLayer* of(std::uint32_t index, const VoxelFrame& frame, std::span<const CubicPolynomial> polynomials,
                         std::uint32_t layer) {
    if (index >= layers_.size() || layers_[index] != layer) reduce(index, frame, polynomials, layer);
    return &cubics_[index * polynomials.size()];
  }

  /// What of() is about to be called for.
  void prefetch_for(std::uint32_t index, std::span<const CubicPolynomial> polynomials) const {
    prefetch(polynomials.data(), polynomials.size());
    if (index >= layers_.size()) return;
    prefetch(&layers_[index]);
    prefetch(&cubics_[index * polynomials.size()], polynomials.size());
  }

 private:
  void reduce(std::uint32_t index, const VoxelFrame& frame, std::span<const CubicPolynomial> polynomials,
              std::uint32_t layer);

  std::vector<std::uint32_t> layers_;  // By index: the layer that its cubics are in.
  std::vector<CubicInLayer> cubics_;   // By index, then by polynomial.
};

class CubicPainter {
 public:
  /// Paints the target's planes of these channels. REQUIRES: target outlives the painter.
  CubicPainter(const LayerTarget& target, std::uint32_t layer, std::span<const ChannelTolerance> channels);

  /// Paints those of the voxels [begin, end) of a row that the planes hold; counts them as interpolated. `cubics`: in
  /// the layer, by channel.
  void paint(const VoxelFrame& frame, const CubicInLayer* cubics, std::uint32_t row, std::uint32_t begin,
             std::uint32_t end) const {
    const VoxelRun part = target_.window.clipped({row, begin, end});
    if (part.begin == part.end) return;
    const Vec3 at = frame(Vec3(begin, row, layer_));
    const std::size_t index = target_.window.index(part.begin, row);
    for (const auto& [plane, channel] : planes_) {
      target_.planes[plane].set_cubic(index, part.begin - begin, part.end - part.begin, at.x(), frame.scale.x(),
                                      along_row(cubics[channel], at.y()));
    }
    target_.stats.voxels_interpolated += target_.count(part);
  }

 private:
  const LayerTarget& target_;
  std::uint32_t layer_;
  struct PaintedPlane {
    std::size_t plane, channel;
  };
  std::vector<PaintedPlane> planes_;
};

}  // namespace ccslice
