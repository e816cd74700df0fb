// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/voxel_blocks.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

class VoxelBlocksTest : public testing::Test {
 protected:
  VoxelBlocksTest() {
    ControlMesh mesh = oracle::fan_mesh(5, 2, 2);
    oracle::add_random_channels(mesh, 3, 5);
    solid_ = prepare_solid(mesh);
    spec_.placement.linear() =
        Mat3(Eigen::AngleAxisd(0.7, Vec3(1, 2, -0.5).normalized())) * Vec3(1, 2, -0.5).asDiagonal();
    spec_.placement.translation() = Vec3(4, -50, 7);
    spec_.grid.origin_mm = Vec3(-3, 2, 1);
    spec_.grid.pitch = {0.1, 0.12, 0.09};
    spec_.grid.extent = {90, 70, 40};
    spec_.channels = {{2, 1e-3}, {0, 1e-3}};
  }

  Solid solid_;
  InterpolationSpec spec_;
};

TEST_F(VoxelBlocksTest, CentresOfVoxelsAreAtTheirNumbers) {
  const Placement voxel_of_world = voxel_of_mesh(Placement::Identity(), spec_.grid);
  const Vec3 centre = spec_.grid.lattice().centre(7, 60, spec_.grid.layer_z_mm(33));
  EXPECT_LT((voxel_of_world * centre - Vec3(7, 60, 33)).norm(), 1e-10);
  const Placement voxel_of_mesh_mm = voxel_of_mesh(spec_.placement, spec_.grid);
  const Vec3 point(12, 5, 9);
  EXPECT_LT((voxel_of_mesh_mm * point - voxel_of_world * (spec_.placement * point)).norm(), 1e-9);
}

TEST_F(VoxelBlocksTest, AreWhatTheEvaluatorSaysAtTheNodes) {
  VoxelBlocks blocks(*solid_, spec_);
  LimitEvaluator evaluator(*solid_);
  const Placement voxel_of_mesh_mm = voxel_of_mesh(spec_.placement, spec_.grid);
  const ParamBox box{Vec3(0, 0.5, 0.25), Vec3(0.5, 1, 0.5)};
  BlockPlacesInVoxels places;
  std::vector<BlockValues> values(7);
  std::vector<double> channels(3);
  for (const LimitCellId cell : solid_->cells()) {
    blocks.sample(cell, box, places, values);
    ASSERT_EQ(values.size(), 2u);
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const Vec3 share =
          Vec3(n % kBlockNodes, n / kBlockNodes % kBlockNodes, n / kBlockNodes / kBlockNodes) / (kBlockNodes - 1.0);
      const Vec3 uvw = box.low + share.cwiseProduct(box.high - box.low);
      const Vec3 voxel = voxel_of_mesh_mm * evaluator.geo_and_mat({cell, uvw}, channels);
      EXPECT_LT((at_slot(places, block_slot(n)) - voxel).norm(), 1e-9);
      EXPECT_NEAR(values[0][block_slot(n) / kLanes][block_slot(n) % kLanes], channels[2], 1e-12);
      EXPECT_NEAR(values[1][block_slot(n) / kLanes][block_slot(n) % kLanes], channels[0], 1e-12);
    }
  }
}

TEST_F(VoxelBlocksTest, EnterTheFrameOfAFit) {
  const VoxelFrame frame = VoxelFrame::of(Vec3(10, 20, 30), Vec3(20, 24, 30));
  BlockPlacesInVoxels places{};
  places[0][0] = Lanes{10, 15, 20, 0};
  places[1][0] = Lanes{20, 22, 24, 0};
  places[2][0] = Lanes{30, 31, 29, 0};
  enter_frame(frame, 1, places);
  EXPECT_EQ(at_slot(places, 0), Vec3(-1, -1, 0));
  EXPECT_EQ(at_slot(places, 1), Vec3(0, 0, 1));
  EXPECT_EQ(at_slot(places, 2), Vec3(1, 1, -1));
}

TEST_F(VoxelBlocksTest, GrowByAShareAndAVoxel) {
  const Box3 box = grown(Box3(Vec3(0, 0, 0), Vec3(10, 20, 0)), 0.1);
  EXPECT_EQ(box.min(), Vec3(-2, -3, -1));
  EXPECT_EQ(box.max(), Vec3(12, 23, 1));
}

}  // namespace
}  // namespace ccslice
