// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/small_cells.h"

#include <gtest/gtest.h>

#include <memory>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

Placement mesh_of_voxels(double pitch_mm) {
  Placement placement = Placement::Identity();
  placement.scale(pitch_mm);
  return placement;
}

/// A sharp box of cells of 4 x 4 x 4 mm: all of them regular.
std::shared_ptr<const LimitSolid> regular_box(int cells) {
  BoxShape shape;
  shape.cells_x = shape.cells_y = shape.cells_z = cells;
  shape.size_mm = Vec3::Constant(4.0 * cells);
  return prepare_solid(make_box(shape));
}

TEST(SmallCells, ARegularCellOfFewerThanFiveThousandVoxelsIsSmall) {
  const auto solid = regular_box(3);
  const SmallCells fine(solid, mesh_of_voxels(4 / 17.2), true), coarse(solid, mesh_of_voxels(4 / 17.0), true);
  EXPECT_FALSE(fine.are_all()) << "17.2^3 = 5088";
  EXPECT_FALSE(fine.contain(LimitCellId{0}));
  EXPECT_FALSE(fine.any_at(Vec3(10, 10, 10)));
  EXPECT_TRUE(coarse.are_all()) << "17^3 = 4913";
  EXPECT_TRUE(coarse.contain(LimitCellId{0}));
  EXPECT_TRUE(coarse.any_at(Vec3(10, 10, 10)));
  EXPECT_TRUE(coarse.any_at(Vec3(-1e6, 0, 0))) << "all are, so nobody looks";
}

TEST(SmallCells, SoIsOneOfFewerThanTwentyThousandInAWholeBrickIfTilesFit) {
  const auto solid = regular_box(4);
  const auto is_small = [&](double voxels_along, bool tiles_fit) {
    const SmallCells small(solid, mesh_of_voxels(4 / voxels_along), tiles_fit);
    EXPECT_EQ(small.any_at(Vec3(10, 10, 10)), small.contain(LimitCellId{0}));
    return small.contain(LimitCellId{0});
  };
  EXPECT_FALSE(is_small(27.2, true)) << "27.2^3 = 20124";
  EXPECT_TRUE(is_small(27.0, true)) << "27^3 = 19683";
  EXPECT_FALSE(is_small(27.0, false));
  EXPECT_FALSE(is_small(8.5, false)) << "8.5^3 = 614";
  EXPECT_TRUE(is_small(8.4, false)) << "8.4^3 = 593";
}

// A row of small cells and a row of large ones, far apart.
TEST(SmallCells, AVoxelLiesInThemIfABoxOfOneHoldsItOrNearly) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3, 1);
  oracle::append_mesh(mesh, oracle::box_mesh(3, 3, 3, 10), Vec3(100, 0, 0));
  const auto solid = prepare_solid(mesh);
  const double pitch = 0.25;
  const SmallCells small(solid, mesh_of_voxels(pitch), true);
  EXPECT_FALSE(small.are_all());
  EXPECT_TRUE(small.any_at(Vec3(1.5, 1.5, 1.5) / pitch));
  EXPECT_FALSE(small.any_at(Vec3(115, 15, 15) / pitch));
  EXPECT_FALSE(small.any_at(Vec3(50, 1.5, 1.5) / pitch));
  const double left = solid->summary().bounding_box.min().x();
  EXPECT_TRUE(small.any_at(Vec3(left - 0.2, 1.5, 1.5) / pitch)) << "within a voxel of a small cell's box";
  EXPECT_FALSE(small.any_at(Vec3(left - 0.6, 1.5, 1.5) / pitch));
}

}  // namespace
}  // namespace ccslice
