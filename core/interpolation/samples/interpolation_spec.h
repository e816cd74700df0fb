// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a job's interpolated materials depend on, besides the solid.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/types.h"
#include "core/job/grid.h"

namespace ccslice {

/// A channel to interpolate, and by how much a voxel's value may be off.
struct ChannelTolerance {
  std::uint32_t channel = 0;
  double tolerance = 0;  // > 0, in the channel's own unit.
};

/// REQUIRES: placement passes validate_placement(); channels not empty, each once.
struct InterpolationSpec {
  Placement placement = Placement::Identity();
  Grid grid;
  std::vector<ChannelTolerance> channels;
  double outside_mm =
      0;  // Voxels inside the contours may lie this far off the solid: they take what its boundary has there.
  bool proved = false;     // Nothing is painted by polynomials whose errors are judged by samples.
  std::size_t solids = 1;  // That threads interpolate in turn: what each keeps for speed has a share of the memory.
};

}  // namespace ccslice
