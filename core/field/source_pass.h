// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Values of sources (channel/channel_source.h) at the voxels of a layer: row by row, each source after those that it
// reads.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/field/layer_target.h"
#include "core/output/plane.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

struct UsedSource {
  const ChannelSource* source;
  std::vector<float> bounds;  // SourceRow::bounds: empty if the values themselves matter.
};

/// One thread.
class SourcePass {
 public:
  /// `sources`: each after those that it reads; they outlive this. `planes`: of the targets' planes; the inputs of all
  /// sources are among them as kFloat32. `layer_of_mesh` places the mesh among the layers, and `world_of_layer` is 1
  /// unless the layers lie otherwise than the world's.
  SourcePass(std::span<const UsedSource> sources, std::span<const PlaneSpec> planes, const Placement& layer_of_mesh,
             const Mat3& world_of_layer = Mat3::Identity());

  /// Sets the samples of all planes of the sources at the voxels of `spans` that the target's planes hold. REQUIRES:
  /// planes of other channels have theirs. Throws Error{kCancelled}.
  void run(const LayerTarget& target, std::span<const VoxelRun> spans);

 private:
  /// A source, and the numbers of the planes that it reads and fills.
  struct Step {
    UsedSource use;
    std::vector<std::size_t> inputs, outputs;
  };

  void run_row(const LayerTarget& target, const VoxelRun& run);

  std::vector<Step> steps_;
  Placement mesh_of_layer_;
  Mat3 world_of_layer_;
  // Scratch memory:
  std::vector<std::vector<float>> inputs_;
  std::vector<std::span<const float>> input_spans_;
  std::vector<float> values_;
};

}  // namespace ccslice
