// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/connected_runs.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace ccslice {

std::uint32_t ConnectedRuns::root(std::uint32_t run) noexcept {
  while (parents_[run] != run) run = parents_[run] = parents_[parents_[run]];
  return run;
}

/// Joins runs with those `layer_step` layers and `row_step` rows before: one sweep over both.
void ConnectedRuns::connect_rows(std::span<const VoxelRun> runs, std::uint32_t layer_step, std::uint32_t row_step) {
  const auto place_of = [](std::uint32_t layer, std::uint32_t row) { return std::uint64_t{layer} << 32 | row; };
  std::uint32_t before = 0;
  std::uint64_t place_before = 0;  // Of `before`.
  if (!runs.empty()) place_before = place_of(runs[0].layer, runs[0].row);
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    const VoxelRun& run = runs[r];
    if (run.layer < layer_step || run.row < row_step) continue;
    const std::uint64_t target = place_of(run.layer - layer_step, run.row - row_step);
    while (place_before < target || (place_before == target && runs[before].end <= run.begin)) {
      ++before;
      place_before = place_of(runs[before].layer, runs[before].row);
    }
    for (std::uint32_t k = before; place_of(runs[k].layer, runs[k].row) == target && runs[k].begin < run.end; ++k) {
      const std::uint32_t a = root(k), b = root(r);
      parents_[std::max(a, b)] = std::min(a, b);
    }
  }
}

std::size_t ConnectedRuns::label(std::span<const VoxelRun> runs) {
  parents_.resize(runs.size());
  std::iota(parents_.begin(), parents_.end(), 0u);
  connect_rows(runs, 0, 1);
  connect_rows(runs, 1, 0);
  labels_.resize(runs.size());
  std::size_t parts = 0;
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    const std::uint32_t first = root(r);
    labels_[r] = first == r ? parts++ : labels_[first];
  }
  return parts;
}

}  // namespace ccslice
