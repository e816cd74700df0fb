// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/small_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/cell_bricks.h"
#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

// Voxels of a cell. Of a whole brick a tile takes fewer samples.
constexpr double kSmallestInBricks = 20000, kSmallestWhereTilesFit = 5000, kSmallest = 600;
constexpr std::size_t kWholeBrick = 64;  // Cells.

}  // namespace

SmallCells::SmallCells(std::shared_ptr<const LimitSolid> solid, const Placement& mesh_of_voxel, bool tiles_fit)
    : solid_(std::move(solid)),
      mesh_of_voxel_(mesh_of_voxel),
      smallest_mm3_(kSmallest * std::abs(mesh_of_voxel_.linear().determinant())),
      smallest_regular_mm3_((tiles_fit ? kSmallestWhereTilesFit / kSmallest : 1) * smallest_mm3_),
      smallest_in_bricks_mm3_((tiles_fit ? kSmallestInBricks / kSmallest : 1) * smallest_mm3_),
      are_some_(solid_->index().regular_volumes.least < smallest_in_bricks_mm3_ ||
                solid_->index().irregular_volumes.least < smallest_mm3_),
      are_all_(solid_->index().regular_volumes.most < smallest_regular_mm3_ &&
               solid_->index().irregular_volumes.most < smallest_mm3_),
      voxel_in_mesh_mm_(mesh_of_voxel_.linear().colwise().norm().maxCoeff()) {}

bool SmallCells::contain(LimitCellId cell) const {
  const double volume = solid_->index().volume_mm3(cell);
  if (solid_->cell_class(cell) != CellClass::kRegular) return volume < smallest_mm3_;
  if (volume < smallest_regular_mm3_) return true;
  if (volume >= smallest_in_bricks_mm3_) return false;
  const CellBricks& bricks = solid_->bricks();
  const std::uint32_t brick = bricks.brick_of(cell);
  return brick != kNone && bricks[brick].cell_count() >= kWholeBrick;
}

bool SmallCells::any_at(const Vec3& voxel) const {
  if (!are_some_ || are_all_) return are_all_;
  const Vec3 point = mesh_of_voxel_ * voxel, margin = Vec3::Constant(voxel_in_mesh_mm_);
  return solid_->index().cell_boxes.any_meeting(Box3(point - margin, point + margin),
                                                [&](std::uint32_t cell) { return contain(LimitCellId{cell}); });
}

}  // namespace ccslice
