// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/voxel_blocks.h"

#include <span>
#include <utility>

#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

std::vector<std::uint32_t> channel_ids(std::span<const ChannelTolerance> channels) {
  std::vector<std::uint32_t> ids;
  for (const ChannelTolerance& channel : channels) ids.push_back(channel.channel);
  return ids;
}

}  // namespace

Placement voxel_of_mesh(const Placement& placement, const Grid& grid) {
  const Vec3 pitch(grid.pitch.x_mm, grid.pitch.y_mm, grid.pitch.z_mm);
  Placement result;
  result.linear() = pitch.cwiseInverse().asDiagonal() * placement.linear();
  result.translation() = (placement.translation() - grid.origin_mm).cwiseQuotient(pitch) - Vec3::Constant(0.5);
  return result;
}

void enter_frame(const VoxelFrame& frame, std::size_t groups, BlockPlacesInVoxels& places) noexcept {
  for (int a = 0; a < 3; ++a) {
    BlockValues& along = places[static_cast<std::size_t>(a)];
    for (std::size_t g = 0; g < groups; ++g) along[g] = (along[g] - frame.centre[a]) * frame.scale[a];
  }
}

Box3 grown(const Box3& voxels, double share) {
  const Vec3 margin = share * voxels.diagonal() + Vec3::Ones();
  return Box3(voxels.min() - margin, voxels.max() + margin);
}

VoxelBlocks::VoxelBlocks(const LimitSolid& solid, const InterpolationSpec& spec,
                         std::shared_ptr<BlockStencils> stencils)
    : voxel_of_mesh_(voxel_of_mesh(spec.placement, spec.grid)),
      evaluator_(std::make_unique<LimitEvaluator>(solid, patch_bytes(spec.solids))),
      sampler_(*evaluator_, channel_ids(spec.channels), std::move(stencils)),
      brick_sampler_(solid, channel_ids(spec.channels)),
      residuals_(solid.data(), channel_ids(spec.channels), line_bytes(spec.solids)) {}

bool VoxelBlocks::is_beside_line(LimitCellId cell, const ParamBox& box) const {
  return find_line_box(evaluator_->solid().data(), cell, box).has_value();
}

void VoxelBlocks::sample(LimitCellId cell, const ParamBox& box, BlockPlacesInVoxels& places,
                         std::vector<BlockValues>& values) {
  block_.values.swap(values);
  sampler_.sample(cell, box, block_);
  block_.values.swap(values);
  place(kBlockGroups, places);
}

void VoxelBlocks::sample(const CellBrick& brick, const ParamBox& box, BlockPlacesInVoxels& places,
                         std::vector<BlockValues>& values, BrickResiduals& residuals) {
  block_.values.swap(values);
  brick_sampler_.sample(brick, box, block_, residuals);
  block_.values.swap(values);
  place(kBlockGroups, places);
  const Eigen::Matrix3d sizes = voxel_of_mesh_.linear().cwiseAbs();
  residuals.position = sizes * residuals.position;
  residuals.bulge = sizes * residuals.bulge;
}

void VoxelBlocks::sample_between_nodes(LimitCellId cell, const ParamBox& box, BlockPlacesInVoxels& places,
                                       std::vector<BlockValues>& values) {
  block_.values.swap(values);
  sampler_.sample_between_nodes(cell, box, block_);
  block_.values.swap(values);
  place(kGroupsBetweenNodes, places);
}

bool VoxelBlocks::find_residuals(LimitCellId cell, const ParamBox& box, BlockResiduals& residuals) {
  return residuals_.find(cell, box, residuals);
}

/// The positions of the first groups.
void VoxelBlocks::place(std::size_t groups, BlockPlacesInVoxels& places) const {
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    for (std::size_t g = 0; g < groups; ++g) {
      Lanes voxel = block_.position[0][g] * voxel_of_mesh_.linear()(a, 0) + voxel_of_mesh_.translation()[a];
      for (int b = 1; b < 3; ++b) {
        voxel = multiply_add(block_.position[static_cast<std::size_t>(b)][g], voxel_of_mesh_.linear()(a, b), voxel);
      }
      places[i][g] = voxel;
    }
  }
}

}  // namespace ccslice
