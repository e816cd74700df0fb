// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The comparisons of a hostile job, which hostile_check.h lists.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/job/slice_job.h"
#include "tests/oracle/hostile_channels.h"
#include "tests/oracle/hostile_finding.h"
#include "tests/oracle/hostile_job.h"

namespace ccslice::oracle {

/// A job that was sliced.
struct HostileRun {
  std::uint64_t seed = 0;
  std::shared_ptr<const LimitSolid> solid;
  std::vector<std::optional<LinearMaterial>> linear;  // By channel.
  HostileJob job;
  std::vector<Layer> layers;    // As the job asks for.
  std::vector<Layer> inverted;  // job.inverted_layers with every voxel inverted, as inverting_job() has it.

  const Layer& layer(std::uint32_t index) const { return layers[index - job.first_layer]; }
  Vec3 centre(std::uint32_t column, std::uint32_t row, std::uint32_t layer) const;
  /// Of the contours of one of the inverted layers round a voxel's centre.
  int winding(const Layer& layer, std::uint32_t column, std::uint32_t row) const;
};

/// A voxel of an inverted layer.
struct VoxelIndex {
  std::uint32_t column = 0, row = 0;
  const Layer* layer = nullptr;
};

/// Appends the voxels that were looked into since they are beyond the tolerance.
void compare_tolerance(const HostileRun& run, std::vector<VoxelIndex>& beyond, HostileFinding& finding);

/// Every voxel of channels that are linear in the position, in all layers: their values are known.
void compare_linear(const HostileRun& run, HostileFinding& finding);

/// Compares these voxels, and some random ones.
void compare_with_truth(const HostileRun& run, std::vector<VoxelIndex> voxels, HostileFinding& finding);

void compare_occupancy(const HostileRun& run, HostileFinding& finding);

void count_unresolved(const HostileRun& run, HostileFinding& finding);

/// Slices again, three times.
void compare_bytes(const HostileRun& run, HostileFinding& finding);

}  // namespace ccslice::oracle
