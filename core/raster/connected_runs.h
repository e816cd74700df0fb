// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Connected parts of a set of voxels that is given as runs: voxels are connected if they share a face.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ccslice {

/// Voxels [begin, end) of a row of a layer.
struct VoxelRun {
  std::uint32_t layer, row, begin, end;
};

/// Memory is kept from call to call.
class ConnectedRuns {
 public:
  /// Returns the number of parts. REQUIRES: runs by layer, by row, by column; none empty, no two overlap.
  std::size_t label(std::span<const VoxelRun> runs);
  /// The part of a run: 0 ... parts - 1, by each part's first run.
  std::size_t of_run(std::size_t run) const noexcept { return labels_[run]; }

 private:
  std::uint32_t root(std::uint32_t run) noexcept;
  void connect_rows(std::span<const VoxelRun> runs, std::uint32_t layer_step, std::uint32_t row_step);

  std::vector<std::uint32_t> parents_;
  std::vector<std::size_t> labels_;
};

}  // namespace ccslice
