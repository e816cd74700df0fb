// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Mixes of a printing's materials for colours: weights of the palette (colour_gamut.h) at 33^3 colours, trilinear in
// between, so that any mix of mixes is one. They depend on nothing but the palette: one table serves all colour maps of
// a printing.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/printing/printing.h"

namespace ccslice {

class ColourTable {
 public:
  using Weights = std::array<float, kMaxPrintMaterials>;

  static constexpr std::size_t kNodes = 33;  // Colours along each axis.

  /// Throws Error{kCancelled}.
  explicit ColourTable(const std::vector<PrintMaterial>& palette, const CancellationToken& cancel = {});

  /// The mix for a colour in nodes: red, green and blue from 0 to kNodes - 1, as sRGB values. REQUIRES: within these.
  Weights weights(const std::array<float, 3>& at) const noexcept;

  /// Whether some mix gives the nearest node's colour, or nearly.
  bool is_reached(const std::array<double, 3>& at) const noexcept;

 private:
  std::vector<Weights> weights_;  // By blue, green, red.
  std::vector<bool> reached_;
};

// For every voxel of a colour map: worth inlining.
inline ColourTable::Weights ColourTable::weights(const std::array<float, 3>& at) const noexcept {
  std::array<float, 3> part;
  std::array<std::size_t, 3> strides;
  std::size_t node = 0, stride = 1;
  for (std::size_t axis = 0; axis < 3; ++axis, stride *= kNodes) {
    const std::size_t cell = std::min<std::size_t>(static_cast<std::size_t>(at[axis]), kNodes - 2);
    part[axis] = at[axis] - static_cast<float>(cell);
    node += cell * stride;
    strides[axis] = stride;
  }
  Weights sum{};
  for (std::size_t corner = 0; corner < 8; ++corner) {
    float weight = 1;
    std::size_t neighbour = node;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool upper = (corner >> axis & 1) != 0;
      weight *= upper ? part[axis] : 1 - part[axis];
      neighbour += upper ? strides[axis] : 0;
    }
    for (std::size_t m = 0; m < sum.size(); ++m) sum[m] += weight * weights_[neighbour][m];
  }
  return sum;
}

/// Null if no map of the printing takes colours. Throws Error{kCancelled}.
std::shared_ptr<const ColourTable> colour_table_of(const Printing& printing, const CancellationToken& cancel = {});

}  // namespace ccslice
