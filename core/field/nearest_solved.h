// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The nearest voxel of a layer that has a material, for voxels that have none.
//
// Row by row outwards until no farther row can be nearer. So that a layer that is mostly holes can't take hours, the
// rows looked at are counted: after kMostRows of them a voxel takes the nearest of the nearest row that has any.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/raster/occupancy.h"

namespace ccslice {

class NearestSolved {
 public:
  struct Voxel {
    std::uint32_t x, y;
  };
  static constexpr std::uint64_t kMostRows = 1 << 24;  // About a second.

  /// The voxels of `inside` less those of `unresolved`, both by row, then by column.
  /// REQUIRES: every run of `unresolved` lies within one span of `inside`.
  NearestSolved(std::span<const VoxelRun> inside, std::span<const VoxelRun> unresolved, const LayerLattice& lattice,
                std::uint64_t most_rows = kMostRows);

  bool empty() const noexcept { return runs_.empty(); }
  /// The nearest solved voxel, by the distance between centres in mm; ties: lower row, then lower column. REQUIRES:
  /// !empty().
  Voxel nearest(std::uint32_t x, std::uint32_t y) noexcept;

 private:
  void find_nearest_rows();
  [[nodiscard]] std::optional<std::uint32_t> nearest_column(std::uint32_t x, std::uint32_t y) const noexcept;

  double dx_mm_, dy_mm_;
  std::uint32_t height_;
  std::vector<VoxelRun> runs_;
  std::vector<std::size_t> row_begin_;      // Runs of row y: [row_begin_[y], row_begin_[y + 1]).
  std::vector<std::uint32_t> nearest_row_;  // By row: the nearest row that has runs; of two as near, the lower.
  std::uint64_t rows_left_;
};

}  // namespace ccslice
