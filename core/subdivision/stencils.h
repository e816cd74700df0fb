// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A linear map between sets of control points, as sparse rows: child[r] = sum over r's entries of weight *
// parent[index]. Subdivision is nothing but such maps, so positions, channels and whole operators go through the same
// rows.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/lanes.h"

namespace ccslice {

struct Stencils {
  std::vector<std::uint32_t> offsets = {0};
  std::vector<std::uint32_t> indices;
  std::vector<double> weights;

  std::uint32_t rows() const { return static_cast<std::uint32_t>(offsets.size() - 1); }

  void append(std::span<const std::pair<std::uint32_t, double>> row) {
    for (const auto& [index, weight] : row) {
      indices.push_back(index);
      weights.push_back(weight);
    }
    offsets.push_back(static_cast<std::uint32_t>(indices.size()));
  }

  void shrink_to_fit() {
    offsets.shrink_to_fit();
    indices.shrink_to_fit();
    weights.shrink_to_fit();
  }

  /// All rows of positions.
  std::vector<Eigen::Vector3d> apply(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<Eigen::Vector3d> out(rows());
    if (!out.empty()) apply(0, rows(), points.front().data(), 3, out.front().data());
    return out;
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
      for (std::uint32_t e = offsets[chosen[r]]; e < offsets[chosen[r] + 1]; ++e) {
        const double* point = points + indices[e] * dimension;
        const double weight = weights[e];
        for (std::size_t k = 0; k < dimension; ++k) out[k] += weight * point[k];
      }
    }
  }
  void apply(std::uint32_t first_row, std::uint32_t count, const double* points, std::size_t dimension,
             double* out) const noexcept {
    apply(RowRange{first_row, count}, points, dimension, out);
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
  void apply_to_layers(std::uint32_t first_row, std::uint32_t count, const double* points, std::size_t layer_points,
                       std::size_t dimension, double* out) const noexcept {
    apply_to_layers(RowRange{first_row, count}, points, layer_points, dimension, out);
  }

 private:
  struct RowRange {
    std::uint32_t first, count;
    std::size_t size() const { return count; }
    std::uint32_t operator[](std::size_t r) const { return first + static_cast<std::uint32_t>(r); }
  };

  /// Goes through a row once for all layers: what it costs to find the points and where the row ends is as much as one
  /// layer's sum.
  template <std::size_t kLayers, typename Rows>
  void apply_to_registers(const Rows& chosen, const double* points, std::size_t layer, double* out) const noexcept {
    const std::uint32_t *row_begin = offsets.data(), *index = indices.data();
    const double* weight = weights.data();
    const std::size_t count = chosen.size();
    for (std::size_t r = 0; r < count; ++r) {
      std::array<Lanes, kLayers> sums{};
      const std::uint32_t end = row_begin[chosen[r] + 1];
      for (std::uint32_t e = row_begin[chosen[r]]; e < end; ++e) {
        const double* point = points + kLanes * index[e];
        for (std::size_t l = 0; l < kLayers; ++l) sums[l] += weight[e] * load_unaligned(point + l * layer);
      }
      for (std::size_t l = 0; l < kLayers; ++l) store_unaligned(sums[l], out + kLanes * (l * count + r));
    }
  }
};

}  // namespace ccslice
