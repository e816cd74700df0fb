// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The rectangle of a layer that is worked on. A region's pictures hold a part of the layer only.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/raster/voxel_runs.h"

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

/// What both hold: no columns or no rows if that is nothing.
inline LayerWindow common_window(const LayerWindow& a, const LayerWindow& b) {
  const std::uint32_t column = std::max(a.first_column, b.first_column), row = std::max(a.first_row, b.first_row);
  return {column, row, std::max(column, std::min(a.end_column(), b.end_column())) - column,
          std::max(row, std::min(a.end_row(), b.end_row())) - row};
}

/// The smallest one that holds both; an empty one holds nothing.
inline LayerWindow joint_window(const LayerWindow& a, const LayerWindow& b) {
  if (a.columns == 0 || a.rows == 0) return b;
  if (b.columns == 0 || b.rows == 0) return a;
  const std::uint32_t column = std::min(a.first_column, b.first_column), row = std::min(a.first_row, b.first_row);
  return {column, row, std::max(a.end_column(), b.end_column()) - column, std::max(a.end_row(), b.end_row()) - row};
}

/// From a multiple of 8 columns to another, so that rows of samples of 1, 2 and 4 bits begin and end with a byte.
inline LayerWindow whole_bytes(const LayerWindow& window) {
  constexpr std::uint32_t kByte = 8;
  const std::uint32_t first = window.first_column / kByte * kByte;
  return {first, window.first_row, (window.end_column() - first + kByte - 1) / kByte * kByte, window.rows};
}

/// The smallest one that holds all spans. `spans`: by row.
inline LayerWindow window_of(std::span<const VoxelRun> spans) {
  if (spans.empty()) return {};
  std::uint32_t begin = spans.front().begin, end = spans.front().end;
  for (const VoxelRun& span : spans) {
    begin = std::min(begin, span.begin);
    end = std::max(end, span.end);
  }
  return {begin, spans.front().row, end - begin, spans.back().row + 1 - spans.front().row};
}

}  // namespace ccslice
