// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The rectangle of a layer that is worked on. A region's pictures hold a part of the layer only.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/raster/occupancy.h"

namespace ccslice {

/// The columns and rows of a layer that pictures of it hold. Columns and rows are numbered as in the whole layer.
struct LayerWindow {
  std::uint32_t first_column = 0, first_row = 0;
  std::uint32_t columns = 0, rows = 0;

  std::uint32_t end_column() const { return first_column + columns; }
  std::uint32_t end_row() const { return first_row + rows; }
  /// Index of a voxel of the window, by row, then by column.
  std::size_t index(std::uint32_t column, std::uint32_t row) const {
    return std::size_t{columns} * (row - first_row) + (column - first_column);
  }
  /// What the window holds of a span: [begin, end) with begin == end if that is nothing.
  VoxelRun clipped(const VoxelRun& span) const {
    if (span.row < first_row || span.row >= end_row()) return {span.row, span.begin, span.begin};
    // Most are held as a whole. The least and largest of numbers GCC takes by way of memory to vector registers.
    if (span.begin >= first_column && span.begin <= span.end && span.end <= end_column()) return span;
    const std::uint32_t begin = std::max(span.begin, first_column);
    return {span.row, begin, std::max(begin, std::min(span.end, end_column()))};
  }
  bool operator==(const LayerWindow&) const = default;
};

/// All of a layer.
inline LayerWindow window_of(const LayerLattice& lattice) { return {0, 0, lattice.width, lattice.height}; }

}  // namespace ccslice
