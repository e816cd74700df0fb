// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Stencils that are kept: an operator has few different weights, so an entry is a column and which of them it has, in
// four bytes instead of twelve. Of tetrahedra hardly two stars are alike, and each has some thousand entries.

#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/subdivision/sparse_rows.h"
#include "core/subdivision/stencils.h"

namespace ccslice {

class PackedStencils {
 public:
  PackedStencils() = default;
  explicit PackedStencils(const Stencils& stencils);

  std::uint32_t rows() const { return static_cast<std::uint32_t>(row_begin_.size() - 1); }
  std::size_t memory_bytes() const;

  /// As of SparseRows, with the same sums to the last bit as of the stencils.
  template <typename Visit>
  void for_each(std::uint32_t row, Visit visit) const {
    with_rows([&](const auto& all) { all.for_each(row, visit); });
  }
  template <typename Rows>
  void apply(const Rows& chosen, const double* points, std::size_t dimension, double* out) const noexcept {
    with_rows([&](const auto& all) { all.apply(chosen, points, dimension, out); });
  }
  void apply(std::uint32_t first_row, std::uint32_t count, const double* points, std::size_t dimension,
             double* out) const noexcept {
    apply(NeighbouringRows{first_row, count}, points, dimension, out);
  }
  template <typename Rows>
  void apply_to_layers(const Rows& chosen, const double* points, std::size_t layer_points, std::size_t dimension,
                       double* out) const noexcept {
    with_rows([&](const auto& all) { all.apply_to_layers(chosen, points, layer_points, dimension, out); });
  }
  void apply_to_layers(std::uint32_t first_row, std::uint32_t count, const double* points, std::size_t layer_points,
                       std::size_t dimension, double* out) const noexcept {
    apply_to_layers(NeighbouringRows{first_row, count}, points, layer_points, dimension, out);
  }

 private:
  /// `weight`: which of the different ones.
  template <typename Number>
  struct Entry {
    Number column, weight;
  };
  using Short = std::vector<Entry<std::uint16_t>>;
  using Long = std::vector<Entry<std::uint32_t>>;  // Of more columns or weights, as at a vertex of ten thousand cells.

  template <typename Number>
  struct Entries {
    const Entry<Number>* entries;
    const double* weights;
    std::uint32_t column(std::uint32_t e) const { return entries[e].column; }
    double weight(std::uint32_t e) const { return weights[entries[e].weight]; }
  };

  template <typename Number>
  void pack(const Stencils& stencils, const std::vector<std::uint32_t>& weight_of_entry);

  template <typename Use>
  void with_rows(Use use) const {
    if (const auto* entries = std::get_if<Short>(&entries_)) {
      use(SparseRows<Entries<std::uint16_t>>{row_begin_.data(), {entries->data(), weights_.data()}});
    } else {
      use(SparseRows<Entries<std::uint32_t>>{row_begin_.data(), {std::get<Long>(entries_).data(), weights_.data()}});
    }
  }

  std::vector<std::uint32_t> row_begin_ = {0};
  std::variant<Short, Long> entries_;
  std::vector<double> weights_;
};

}  // namespace ccslice
