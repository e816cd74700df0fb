// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/material_pass.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace ccslice {
namespace {

constexpr std::int64_t kHintReach = 16;  // Columns.

/// The entries at columns [low, high], of some that ascend.
std::span<const RowEntry> within(std::span<const RowEntry> entries, std::int64_t low, std::int64_t high) {
  const auto below = [](const RowEntry& entry, std::int64_t column) { return entry.point < column; };
  const auto begin = std::lower_bound(entries.begin(), entries.end(), low, below);
  return {begin, std::lower_bound(begin, entries.end(), high + 1, below)};
}

}  // namespace

WindowOutcome MaterialPass::run(const LayerTarget& target, std::span<const VoxelRun> spans) {
  start_layer();
  for (const VoxelRun& span : spans) solve(target, span);
  return finish_layer(target, spans);
}

void MaterialPass::start_layer() {
  unresolved_.clear();
  row_.reset();
  entries_.clear();
  entries_below_.clear();
}

void MaterialPass::start_row(std::uint32_t y) {
  entries_.swap(entries_below_);
  entries_.clear();
  if ((row_ && *row_ + 1 != y) || y % kRowsTogether == 0) entries_below_.clear();
  row_ = y;
}

void MaterialPass::solve(const LayerTarget& target, const VoxelRun& run, const std::optional<CellParam>& hint) {
  if (row_ != run.row) start_row(run.row);
  const std::optional<CellParam> near = nearest_entry(run.begin);
  solve_near(target, run, near ? near : hint);
}

void MaterialPass::solve_from(const LayerTarget& target, const HintedRun& run) {
  if (!run.hint) return solve(target, run);
  if (row_ != run.row) start_row(run.row);
  solve_near(target, run, run.hint);
}

void MaterialPass::solve_near(const LayerTarget& target, const VoxelRun& run, const std::optional<CellParam>& near) {
  const Vec3 first = target.lattice.centre(run.begin, run.row, target.z_mm);
  const Vec3 step = target.lattice.centre(run.begin + 1, run.row, target.z_mm) - first;
  field_->solve_row(first, step, run.end - run.begin, near, beside(run), target.cancel, solved_);
  keep(target, run);
}

std::span<const RowEntry> MaterialPass::beside(const VoxelRun& run) {
  beside_.clear();
  if (run.end - run.begin == 1) return beside_;  // Nothing comes after it that could go on so.
  for (const RowEntry& entry : within(entries_below_, run.begin - kHintReach, run.end + kHintReach)) {
    beside_.push_back({entry.point - run.begin, entry.at});
  }
  return beside_;
}

void MaterialPass::keep(const LayerTarget& target, const VoxelRun& run) {
  LayerStats& stats = target.stats;
  stats.max_residual_mm = std::max(stats.max_residual_mm, solved_.max_residual_mm);
  for (std::uint32_t k = 0; k < run.end - run.begin; ++k) {
    if (solved_.points[k] == RowPoint::kUnresolved) unresolved_.add(run.row, run.begin + k);
  }
  const VoxelRun counted = target.counted.clipped(run);
  for (std::uint32_t x = counted.begin; x < counted.end; ++x) {
    const RowPoint point = solved_.points[x - run.begin];
    stats.voxels_coherent += point == RowPoint::kCoherent;
    stats.voxels_full += point == RowPoint::kFull;
  }
  for (const RowEntry& entry : solved_.entries) entries_.push_back({entry.point + run.begin, entry.at});
  if (solved_.last) entries_.push_back({std::int64_t{run.end} - 1, *solved_.last});
  const VoxelRun held = target.window.clipped(run);
  if (held.begin == held.end) return;
  const std::size_t channels = field_->channel_count();
  const auto values = std::span(solved_.values).subspan((held.begin - run.begin) * channels);
  const std::size_t index = target.window.index(held.begin, run.row);
  for (ContonePlane& plane : target.planes) plane.set_run(index, held.end - held.begin, values, channels);
}

std::optional<CellParam> MaterialPass::nearest_entry(std::int64_t column) const {
  std::int64_t nearest = kHintReach + 1;
  std::optional<CellParam> hint;
  for (const std::vector<RowEntry>* entries : {&entries_, &entries_below_}) {
    for (const RowEntry& entry : within(*entries, column - kHintReach, column + kHintReach)) {
      const std::int64_t distance = std::abs(entry.point - column);
      if (distance >= nearest) continue;
      nearest = distance;
      hint = entry.at;
    }
  }
  return hint;
}

WindowOutcome MaterialPass::finish_layer(const LayerTarget& target, std::span<const VoxelRun> spans) const {
  return unresolved_.fill(*field_, spans, target);
}

}  // namespace ccslice
