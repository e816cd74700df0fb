// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/unresolved_voxels.h"

#include <algorithm>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/field/nearest_solved.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kVoxelsPerPoll = 256;

}  // namespace

void UnresolvedVoxels::add(std::uint32_t row, std::uint32_t column) {
  if (!runs_.empty() && runs_.back().row == row && runs_.back().end == column) {
    ++runs_.back().end;
  } else {
    runs_.push_back({row, column, column + 1});
  }
}

WindowOutcome UnresolvedVoxels::fill(MaterialField& field, std::span<const VoxelRun> spans,
                                     const LayerTarget& target) const {
  if (runs_.empty()) return WindowOutcome::kComplete;
  if (!target.is_whole) {
    const bool holds_none = std::ranges::all_of(runs_, [&](const VoxelRun& run) {
      const VoxelRun held = target.window.clipped(run);
      return held.begin == held.end;
    });
    return holds_none ? WindowOutcome::kComplete : WindowOutcome::kNeedsWholeLayer;
  }
  for (const VoxelRun& run : runs_) target.stats.voxels_unresolved += target.count(run);
  NearestSolved solved(spans, runs_, target.lattice);
  if (solved.empty()) {
    fill_from_solid(field, target);
    return WindowOutcome::kComplete;
  }
  for (const VoxelRun& run : runs_) {
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      if ((x - run.begin) % kVoxelsPerPoll == 0) target.cancel.throw_if_cancelled();
      const NearestSolved::Voxel source = solved.nearest(x, run.row);
      const std::size_t from = target.window.index(source.x, source.y), to = target.window.index(x, run.row);
      for (ContonePlane& plane : target.planes) plane.copy(from, to);
    }
  }
  return WindowOutcome::kComplete;
}

void UnresolvedVoxels::fill_from_solid(MaterialField& field, const LayerTarget& target) const {
  std::vector<double> values(field.channel_count());
  for (const VoxelRun& run : runs_) {
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      target.cancel.throw_if_cancelled();
      const std::optional<InversionResult> found = field.nearest(target.lattice.centre(x, run.row, target.z_mm));
      if (!found) {
        throw Error(ErrorCode::kInternal, "no material for voxel (" + std::to_string(x) + ", " +
                                              std::to_string(run.row) + ") at z = " + std::to_string(target.z_mm) +
                                              " mm, inside the contours");
      }
      field.mat(found->at, values);
      const std::size_t index = target.window.index(x, run.row);
      for (ContonePlane& plane : target.planes) plane.set(index, values);
    }
  }
}

}  // namespace ccslice
