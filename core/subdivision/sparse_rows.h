// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sums over the rows of a sparse matrix, in whatever form its entries are kept.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/lanes.h"

namespace ccslice {

/// A view. `Entries`: column(e) and weight(e), by number through all rows; row r has those from row_begin[r] to
/// row_begin[r + 1].
template <typename Entries>
struct SparseRows {
  const std::uint32_t* row_begin;
  Entries entries;

  /// Calls visit(column, weight) for each entry of a row.
  template <typename Visit>
  void for_each(std::uint32_t row, Visit visit) const {
    for (std::uint32_t e = row_begin[row]; e < row_begin[row + 1]; ++e) visit(entries.column(e), entries.weight(e));
  }

  /// Points of `dimension` doubles each: one after the other, of the rows that are chosen. `chosen`: a size, and row
  /// numbers by []. REQUIRES: out holds chosen.size() * dimension, disjoint from `points`.
  template <typename Rows>
  void apply(const Rows& chosen, const double* points, std::size_t dimension, double* out) const noexcept {
    if (dimension == kLanes) {  // Positions with one channel, or padded: one register.
      apply_to_registers<1>(chosen, points, 0, out);
      return;
    }
    for (std::size_t r = 0; r < chosen.size(); ++r, out += dimension) {
      for (std::size_t k = 0; k < dimension; ++k) out[k] = 0;
      for_each(chosen[r], [&](std::uint32_t column, double weight) {
        const double* point = points + column * dimension;
        for (std::size_t k = 0; k < dimension; ++k) out[k] += weight * point[k];
      });
    }
  }

  /// The same of four layers of `layer_points` points each, one after the other. REQUIRES: out holds 4 *
  /// chosen.size() * dimension.
  template <typename Rows>
  void apply_to_layers(const Rows& chosen, const double* points, std::size_t layer_points, std::size_t dimension,
                       double* out) const noexcept {
    if (dimension == kLanes) return apply_to_registers<4>(chosen, points, layer_points * kLanes, out);
    for (std::size_t layer = 0; layer < 4; ++layer) {
      apply(chosen, points + layer * layer_points * dimension, dimension, out + layer * chosen.size() * dimension);
    }
  }

 private:
  /// Goes through a row once for all layers: what it costs to find the points and where the row ends is as much as one
  /// layer's sum.
  template <std::size_t kLayers, typename Rows>
  void apply_to_registers(const Rows& chosen, const double* points, std::size_t layer, double* out) const noexcept {
    const std::size_t count = chosen.size();
    for (std::size_t r = 0; r < count; ++r) {
      std::array<Lanes, kLayers> sums{};
      const std::uint32_t end = row_begin[chosen[r] + 1];
      for (std::uint32_t e = row_begin[chosen[r]]; e < end; ++e) {
        const double* point = points + kLanes * entries.column(e);
        const double weight = entries.weight(e);
        for (std::size_t l = 0; l < kLayers; ++l) sums[l] += weight * load_unaligned(point + l * layer);
      }
      for (std::size_t l = 0; l < kLayers; ++l) store_unaligned(sums[l], out + kLanes * (l * count + r));
    }
  }
};

/// So many from the first on.
struct NeighbouringRows {
  std::uint32_t first, count;
  std::size_t size() const { return count; }
  std::uint32_t operator[](std::size_t r) const { return first + static_cast<std::uint32_t>(r); }
};

}  // namespace ccslice
