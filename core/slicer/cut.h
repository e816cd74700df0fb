// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Voxels that a job cuts out of a part: those inside where the channel SliceJob::cut is above one half. They are
// background as those outside are.

#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/field/contone.h"
#include "core/raster/layer_window.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

inline constexpr float kCutAbove = 0.5F;

/// Leaves of the runs what lies in the window and isn't cut. `cut`: the values there, as floats. Calls on_cut(VoxelRun)
/// for what is cut. Run: a VoxelRun, or what derives from it.
template <typename Run, typename OnCut>
void cut_runs(const ContonePlane& cut, const LayerWindow& window, std::vector<Run>& runs, const OnCut& on_cut) {
  std::vector<Run> left;
  std::vector<float> values;
  for (const Run& run : runs) {
    const VoxelRun held = window.clipped(run);
    values.resize(held.end - held.begin);
    if (values.empty()) continue;
    cut.read_values(window.index(held.begin, held.row), values);
    for (auto begin = values.begin(); begin != values.end();) {
      const bool is_cut = *begin > kCutAbove;
      const auto end = std::find_if(begin, values.end(), [&](float value) { return (value > kCutAbove) != is_cut; });
      Run part = run;
      part.begin = held.begin + static_cast<std::uint32_t>(begin - values.begin());
      part.end = held.begin + static_cast<std::uint32_t>(end - values.begin());
      is_cut ? on_cut(static_cast<const VoxelRun&>(part)) : left.push_back(part);
      begin = end;
    }
  }
  runs = std::move(left);
}

}  // namespace ccslice
