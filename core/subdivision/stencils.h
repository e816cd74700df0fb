// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A linear map between sets of control points, as sparse rows: child[r] = sum over r's entries of weight *
// parent[index]. Subdivision is nothing but such maps, so positions, channels and whole operators go through the same
// rows.

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/subdivision/sparse_rows.h"

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

  /// All rows of positions.
  std::vector<Eigen::Vector3d> apply(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<Eigen::Vector3d> out(rows());
    if (!out.empty()) apply(0, rows(), points.front().data(), 3, out.front().data());
    return out;
  }

  /// See SparseRows.
  void apply(std::uint32_t first_row, std::uint32_t count, const double* points, std::size_t dimension,
             double* out) const noexcept {
    const SparseRows<Entries> all{offsets.data(), {indices.data(), weights.data()}};
    all.apply(NeighbouringRows{first_row, count}, points, dimension, out);
  }

 private:
  struct Entries {
    const std::uint32_t* indices;
    const double* weights;
    std::uint32_t column(std::uint32_t e) const { return indices[e]; }
    double weight(std::uint32_t e) const { return weights[e]; }
  };
};

}  // namespace ccslice
