// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Voxels that a job cuts out of a part: those inside where the channel SliceJob::cut is above one half. They are
// background as those outside are.

#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/error.h"
#include "core/field/contone.h"
#include "core/raster/layer_window.h"
#include "core/raster/region_runs.h"
#include "core/raster/voxel_runs.h"
#include "core/slicer/part_planes.h"

namespace ccslice {

inline constexpr float kCutAbove = 0.5F;

/// Runs that a cut may leave of a layer's voxels: in large layers those of eight voxels on average.
inline std::uint64_t most_cut_runs(const LayerWindow& window) {
  constexpr std::uint64_t kOfSmallLayers = 1 << 20;
  return std::max(kOfSmallLayers, std::uint64_t{window.columns} * window.rows / 8);
}

/// Leaves of the runs what lies in the window and isn't cut. `cut`: the values there, as floats. Calls on_cut(VoxelRun)
/// for what is cut. Run: a VoxelRun, or what derives from it. Throws Error{kCancelled}, and Error{kFieldInvalid} if
/// more than most_cut_runs() are left.
template <typename Run, typename OnCut>
void cut_runs(const ContonePlane& cut, const LayerWindow& window, std::vector<Run>& runs, const OnCut& on_cut,
              const CancellationToken& cancel) {
  constexpr std::size_t kRunsPerPoll = 256;
  std::vector<Run> left;
  std::vector<float> values;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i % kRunsPerPoll == 0) cancel.throw_if_cancelled();
    const VoxelRun held = window.clipped(runs[i]);
    values.resize(held.end - held.begin);
    if (values.empty()) continue;
    cut.read_values(window.index(held.begin, held.row), values);
    for (auto begin = values.begin(); begin != values.end();) {
      const bool is_cut = *begin > kCutAbove;
      const auto end = std::find_if(begin, values.end(), [&](float value) { return (value > kCutAbove) != is_cut; });
      Run part = runs[i];
      part.begin = held.begin + static_cast<std::uint32_t>(begin - values.begin());
      part.end = held.begin + static_cast<std::uint32_t>(end - values.begin());
      is_cut ? on_cut(static_cast<const VoxelRun&>(part)) : left.push_back(part);
      begin = end;
    }
    if (left.size() <= most_cut_runs(window)) continue;
    throw Error(ErrorCode::kFieldInvalid,
                "cut: it leaves more than " + std::to_string(most_cut_runs(window)) +
                    " runs of voxels in a layer, as where it changes from voxel to voxel; make it coarser",
                "cut");
  }
  runs = std::move(left);
}

/// Cuts a part's runs, and sets samples that are shown to what they are outside where it does. `window`: what the
/// planes hold. Throws like cut_runs().
inline void cut_part(PartPlanes& planes, const LayerWindow& window, std::vector<VoxelRun>& spans,
                     std::vector<RegionRun>& regions, const CancellationToken& cancel) {
  const auto clear = [&](const VoxelRun& run) {
    planes.clear_run(window.index(run.begin, run.row), run.end - run.begin);
  };
  const auto ignore = [](const VoxelRun&) {};
  cut_runs(planes.cut(), window, spans, clear, cancel);
  cut_runs(planes.cut(), window, regions, ignore, cancel);
}

}  // namespace ccslice
