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

  /// Points of `dimension` doubles each. REQUIRES: out holds count * dimension, disjoint from `points`.
  void apply(std::uint32_t first_row, std::uint32_t count, const double* points, std::size_t dimension,
             double* out) const noexcept {
    if (dimension == 4) {  // Positions with one channel, or padded: one register.
      apply_quads(first_row, count, points, out);
      return;
    }
    for (std::uint32_t r = 0; r < count; ++r, out += dimension) {
      for (std::size_t k = 0; k < dimension; ++k) out[k] = 0;
      for (std::uint32_t e = offsets[first_row + r]; e < offsets[first_row + r + 1]; ++e) {
        const double* point = points + indices[e] * dimension;
        const double weight = weights[e];
        for (std::size_t k = 0; k < dimension; ++k) out[k] += weight * point[k];
      }
    }
  }

 private:
  void apply_quads(std::uint32_t first_row, std::uint32_t count, const double* points, double* out) const noexcept {
    for (std::uint32_t r = 0; r < count; ++r, out += 4) {
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (std::uint32_t e = offsets[first_row + r]; e < offsets[first_row + r + 1]; ++e) {
        sum += weights[e] * Eigen::Map<const Eigen::Vector4d>(points + std::size_t{indices[e]} * 4);
      }
      Eigen::Map<Eigen::Vector4d>(out, 4) = sum;
    }
  }
};

}  // namespace ccslice
