// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A random slicing job from a seed: placement, pitch, place of the grid, tolerances, range of layers, region, and
// planes of channels, the occupancy, cell regions, materials and their masks (hostile_printing.h).

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/job/slice_job.h"

namespace ccslice::oracle {

struct HostileJob {
  SliceJob job;                                    // All of the grid; raw planes, the last is the occupancy.
  SliceJob asked;                                  // The same in any encodings, order and contours.
  std::uint32_t first_layer = 0, layer_count = 0;  // What of it to slice,
  std::vector<std::uint32_t> inverted_layers;      // and of that what to compare with every voxel inverted. Ascending.
  double most_inverted = 0;                        // All layers are, if no more voxels than that are inside.
  std::optional<VoxelBox> region;                  // Try a crop too. Its layers are some of those.
  std::string description;                         // In one line.
};

/// Draws layers to invert of about `most_voxels` at most, those outside of the part included, and up to ten times as
/// many to interpolate. Planes of materials and cell regions come from a stream of random numbers of their own, and
/// not at all if `only_channels`: nothing else of the job depends on them. Throws what plan_grid() throws.
HostileJob make_hostile_job(std::uint64_t seed, const LimitSolid& solid, double most_voxels,
                            bool only_channels = false);

}  // namespace ccslice::oracle
