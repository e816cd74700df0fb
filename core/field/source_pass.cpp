// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/source_pass.h"

#include <algorithm>
#include <string>

namespace ccslice {

SourcePass::SourcePass(std::span<const UsedSource> sources, std::span<const PlaneSpec> planes,
                       const Placement& layer_of_mesh, const Mat3& world_of_layer)
    : mesh_of_layer_(layer_of_mesh.inverse(Eigen::Affine)), world_of_layer_(world_of_layer) {
  const auto input = [&](const std::string& name) {
    std::size_t plane = 0;
    while (planes[plane].channel != name || planes[plane].sample_type != SampleType::kFloat32) ++plane;
    return plane;
  };
  for (const UsedSource& use : sources) {
    Step& step = steps_.emplace_back(Step{use, {}, {}});
    for (const std::string& name : use.source->inputs()) step.inputs.push_back(input(name));
    inputs_.resize(std::max(inputs_.size(), step.inputs.size()));
    for (std::size_t plane = 0; plane < planes.size(); ++plane) {
      if (planes[plane].channel == use.source->range().name) step.outputs.push_back(plane);
    }
  }
}

void SourcePass::run(const LayerTarget& target, std::span<const VoxelRun> spans) {
  if (steps_.empty()) return;
  // Values don't depend on where the work on a row begins. Sources may take microseconds a voxel.
  constexpr std::uint32_t kVoxelsPerPoll = 1024;
  std::uint32_t since_poll = kVoxelsPerPoll;
  for (const VoxelRun& span : spans) {
    const VoxelRun held = target.window.clipped(span);
    for (std::uint32_t begin = held.begin; begin < held.end;) {
      if (since_poll >= kVoxelsPerPoll) {
        target.cancel.throw_if_cancelled();
        since_poll = 0;
      }
      const std::uint32_t end = begin + std::min(held.end - begin, kVoxelsPerPoll - since_poll);
      run_row(target, {held.row, begin, end});
      since_poll += end - begin;
      begin = end;
    }
  }
}

void SourcePass::run_row(const LayerTarget& target, const VoxelRun& run) {
  const Vec3 first = target.lattice.centre(0, run.row, target.z_mm), step(target.lattice.dx_mm, 0, 0);
  const std::uint32_t count = run.end - run.begin;
  SourceRow row{world_of_layer_ * first,
                world_of_layer_ * step,
                mesh_of_layer_ * first,
                mesh_of_layer_.linear() * step,
                run.begin,
                count};
  const std::size_t index = target.window.index(run.begin, run.row);
  values_.resize(count);
  for (const Step& each : steps_) {
    input_spans_.clear();
    for (std::size_t i = 0; i < each.inputs.size(); ++i) {
      inputs_[i].resize(count);
      target.planes[each.inputs[i]].read_values(index, inputs_[i]);
      input_spans_.emplace_back(inputs_[i]);
    }
    row.cancel = &target.cancel;
    row.bounds = each.use.bounds;
    each.use.source->sample_row(row, input_spans_, values_);
    for (const std::size_t plane : each.outputs) target.planes[plane].set_values(index, values_);
  }
}

}  // namespace ccslice
