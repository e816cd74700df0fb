// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/colour_table.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "core/printing/colour_gamut.h"

namespace ccslice {

ColourTable::ColourTable(const std::vector<PrintMaterial>& palette, const CancellationToken& cancel) {
  std::vector<Vec3> colours;
  std::vector<std::size_t> numbers;  // In the palette, of the colours.
  for (std::size_t m = 0; m < palette.size(); ++m) {
    if (palette[m].leaves_empty) continue;  // It has no light to add.
    colours.push_back(linear_colour(palette[m].rgba));
    numbers.push_back(m);
  }
  const ColourGamut gamut(colours);
  std::array<double, kNodes> level;
  for (std::size_t i = 0; i < kNodes; ++i) level[i] = linear_intensity(static_cast<double>(i) / (kNodes - 1));
  for (std::size_t blue = 0; blue < kNodes; ++blue) {
    cancel.throw_if_cancelled();
    for (std::size_t node = 0; node < kNodes * kNodes; ++node) {
      const ColourMix mix = gamut.mix({level[node % kNodes], level[node / kNodes], level[blue]});
      Weights& weights = weights_.emplace_back();
      for (std::size_t c = 0; c < numbers.size(); ++c) weights[numbers[c]] = static_cast<float>(mix.weights[c]);
      reached_.push_back(mix.distance <= kStrictSlack);
    }
  }
}

bool ColourTable::is_reached(const std::array<double, 3>& at) const noexcept {
  std::size_t node = 0, stride = 1;
  for (const double along : at) {
    node += stride * static_cast<std::size_t>(std::lround(along));
    stride *= kNodes;
  }
  return reached_[node];
}

std::shared_ptr<const ColourTable> colour_table_of(const Printing& printing, const CancellationToken& cancel) {
  for (const MaterialMap* map : maps_of(printing)) {
    if (std::holds_alternative<ColourMap>(map->kind)) {
      return std::make_shared<const ColourTable>(printing.materials, cancel);
    }
  }
  return nullptr;
}

}  // namespace ccslice
