// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Blocks of cells (interpolation/samples/cell_block.h) of a placed solid, with their places in voxels.

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/interpolation/samples/brick_blocks.h"
#include "core/interpolation/samples/cell_block.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/samples/line_residuals.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// What a world in millimetres is in voxels, so that the centre of voxel (column, row, layer) is at those numbers.
Placement voxel_of_mesh(const Placement& placement, const Grid& grid);

/// Voxels at a block's slots.
using BlockPlacesInVoxels = std::array<BlockValues, 3>;

/// Voxels -> the frame's coordinates, of the first groups.
void enter_frame(const VoxelFrame& frame, std::size_t groups, BlockPlacesInVoxels& places) noexcept;

/// A box that is larger by a share of its size and a voxel on each side.
Box3 grown(const Box3& voxels, double share);

/// One thread.
class VoxelBlocks {
 public:
  /// The most bytes that it keeps of its evaluator's patches, and of lines' residuals.
  static constexpr std::size_t patch_bytes(std::size_t solids) { return share_of(kMostPatchBytes, solids); }
  static constexpr std::size_t line_bytes(std::size_t solids) { return share_of(kMostLineBytes, solids); }

  /// `stencils`: of the solid, or its own.
  VoxelBlocks(const LimitSolid& solid, const InterpolationSpec& spec,
              std::shared_ptr<BlockStencils> stencils = nullptr);

  /// Position and channels are tricubic in the box's parameters.
  bool is_in_one_patch(LimitCellId cell, const ParamBox& box) const { return sampler_.is_in_one_patch(cell, box); }
  /// A box of a line cell, or of a line sub-cell of a vertex cell.
  bool is_beside_line(LimitCellId cell, const ParamBox& box) const;
  /// Samples at the nodes. `values`: of the spec's channels.
  void sample(LimitCellId cell, const ParamBox& box, BlockPlacesInVoxels& places, std::vector<BlockValues>& values);
  /// The same of a box of a brick. Its residuals of positions and its bulge are in voxels.
  void sample(const CellBrick& brick, const ParamBox& box, BlockPlacesInVoxels& places,
              std::vector<BlockValues>& values, BrickResiduals& residuals);
  /// Samples between the nodes: the first kGroupsBetweenNodes groups.
  void sample_between_nodes(LimitCellId cell, const ParamBox& box, BlockPlacesInVoxels& places,
                            std::vector<BlockValues>& values);
  /// What interpolation at the nodes leaves out of a box that isn't in one patch, in mm of the mesh. False if the box
  /// is too thin. REQUIRES: is_beside_line().
  bool find_residuals(LimitCellId cell, const ParamBox& box, BlockResiduals& residuals);

 private:
  static constexpr std::size_t kMostPatchBytes = 8 << 20, kMostLineBytes = 8 << 20, kLeastBytes = 1 << 20;
  static constexpr std::size_t share_of(std::size_t bytes, std::size_t solids) {
    return std::max(bytes / solids, kLeastBytes);
  }

  void place(std::size_t groups, BlockPlacesInVoxels& places) const;

  const Placement voxel_of_mesh_;
  std::unique_ptr<LimitEvaluator> evaluator_;  // Stays where it is when this is moved: the sampler points to it.
  CellBlockSampler sampler_;
  BrickSampler brick_sampler_;
  LineResiduals residuals_;
  CellBlock block_;
};

}  // namespace ccslice
