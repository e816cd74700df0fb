// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Runs of voxels: what all stages after the contours hand on. A SPAN is a maximal run of voxels inside the contours.
// Runs that carry more derive from VoxelRun.

#pragma once

#include <cstdint>
#include <limits>

namespace ccslice {

/// Voxels [begin, end) of a row.
struct VoxelRun {
  std::uint32_t row, begin, end;
};

/// Rows [begin, end). DEFAULT: all.
struct RowRange {
  std::uint32_t begin = 0, end = std::numeric_limits<std::uint32_t>::max();
};

}  // namespace ccslice
