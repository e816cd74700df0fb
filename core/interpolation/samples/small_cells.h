// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which cells are too small, in voxels, for pieces of their own: they are left to tiles
// (interpolation/tiles/tile_tree.h). Regular cells may be larger than irregular ones, if fits across cells fail beside
// irregular lines only; in whole bricks (limit/cell_bricks.h), which tiles sample as one, larger still.

#pragma once

#include <cstdint>
#include <memory>

#include "core/base/types.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

class SmallCells {
 public:
  /// `tiles_fit`: across regular cells of some hundred voxels, too (do_tiles_fit()).
  SmallCells(std::shared_ptr<const LimitSolid> solid, const Placement& mesh_of_voxel, bool tiles_fit);

  bool are_some() const { return are_some_; }
  bool are_all() const { return are_all_; }
  bool contain(LimitCellId cell) const;
  /// Some small cell may hold the voxel's centre: its box does, or nearly.
  bool any_at(const Vec3& voxel) const;

 private:
  std::shared_ptr<const LimitSolid> solid_;
  Placement mesh_of_voxel_;
  double smallest_mm3_, smallest_regular_mm3_, smallest_in_bricks_mm3_;  // Smaller cells are small.
  bool are_some_, are_all_;
  double voxel_in_mesh_mm_;  // At most.
};

}  // namespace ccslice
