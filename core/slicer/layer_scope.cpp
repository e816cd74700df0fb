// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_scope.h"

#include <algorithm>
#include <cstdint>

#include "core/slicer/part_planes.h"

namespace ccslice {

LayerScope whole_scope(const SliceJob& job) {
  return {{0, job.grid.extent.rows}, window_of(job.grid.lattice()), region_of(job).window()};
}

LayerScope scope_of(const SliceJob& job) {
  LayerScope scope{{}, region_of(job).window(), region_of(job).window()};
  // Errors come from all voxels before.
  if (chooses_materials(job) && job.printing->halftone.traits().carries_errors) {
    scope.window = {0, 0, job.grid.extent.columns, scope.region.end_row()};
  }
  const std::uint32_t last_block = (scope.window.end_row() - 1) / kRowsTogether;
  scope.rows.begin = scope.window.first_row - scope.window.first_row % kRowsTogether;
  scope.rows.end = std::min((last_block + 1) * kRowsTogether, job.grid.extent.rows);
  return scope;
}

}  // namespace ccslice
