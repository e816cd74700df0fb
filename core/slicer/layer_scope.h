// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What of a layer is worked on, for a region of it.

#pragma once

#include "core/job/slice_job.h"
#include "core/raster/layer_window.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

struct LayerScope {
  RowRange rows;       // Whose voxels are found and solved,
  LayerWindow window;  // what is made of them, as far as they are inside,
  LayerWindow region;  // What is delivered.
};

/// All of the grid, for the job's region.
LayerScope whole_scope(const SliceJob& job);

/// No more than the job's region needs, unless some voxel of it turns out to need the whole layer.
LayerScope scope_of(const SliceJob& job);

}  // namespace ccslice
