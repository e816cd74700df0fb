// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/overlap_measure.h"

#include <gtest/gtest.h>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// What a cube of 10 mm has in common with another one, moved.
CellOverlap overlap_of_cubes(const Vec3& offset) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const ControlMesh one = mesh;
  oracle::append_mesh(mesh, one, offset);
  const auto solid = prepare_solid(mesh);
  CellProbe probe(*solid);
  return OverlapMeasure(*solid, probe).examine(LimitCellId{0});
}

TEST(OverlapMeasure, MeasuresThinOverlapsAcross) {
  for (const double depth_mm : {0.01, 0.5, 3.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 offset = Vec3::Zero();
      offset[axis] = 10 - depth_mm;
      const CellOverlap found = overlap_of_cubes(offset);
      ASSERT_EQ(found.partners.size(), 1u);
      EXPECT_EQ(found.partners[0].cell, LimitCellId{1});
      EXPECT_NEAR(found.partners[0].volume_mm3, 100 * depth_mm, 1e-4 * depth_mm);
      EXPECT_NEAR(found.partners[0].depth_mm, depth_mm, 1e-6);
    }
  }
}

TEST(OverlapMeasure, MeasuresAllOfACellThatIsInAnother) {
  EXPECT_NEAR(overlap_of_cubes(Vec3(0, 0, 0)).partners.at(0).volume_mm3, 1000, 400);
  EXPECT_TRUE(overlap_of_cubes(Vec3(10, 0, 0)).partners.empty());
  EXPECT_TRUE(overlap_of_cubes(Vec3(30, 0, 0)).partners.empty());
}

TEST(OverlapMeasure, NamesTheNeighboursThatComeNear) {
  ControlMesh mesh = oracle::box_mesh(3, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const ControlMesh one = oracle::box_mesh(1, 1, 1);
  oracle::append_mesh(mesh, one, Vec3(2, 2, 6));
  const auto solid = prepare_solid(mesh);
  CellProbe probe(*solid);
  OverlapMeasure measure(*solid, probe);
  std::size_t with_partners = 0;
  for (const LimitCellId cell : solid->cells()) {
    const CellOverlap found = measure.examine(cell);
    EXPECT_EQ(found.partners.empty(), found.neighbours.empty()) << cell;
    with_partners += !found.partners.empty();
    for (const LimitCellId neighbour : found.neighbours) EXPECT_TRUE(solid->touch(cell, neighbour));
  }
  EXPECT_GT(with_partners, 1u);
}

TEST(CellOverlap, KeepsTheDeeperPlaceOfACell) {
  CellOverlap overlap;
  overlap.add({LimitCellId{7}, Vec3(1, 0, 0), 0.1, 2});
  overlap.add({LimitCellId{3}, Vec3(2, 0, 0), 0, 0});
  overlap.add({LimitCellId{7}, Vec3(3, 0, 0), 0.3, 1});
  overlap.add({LimitCellId{7}, Vec3(4, 0, 0), 0.2, 1});
  ASSERT_EQ(overlap.partners.size(), 2u);
  EXPECT_EQ(overlap.partners[0].cell, LimitCellId{3});
  EXPECT_EQ(overlap.partners[1].position, Vec3(3, 0, 0));
  EXPECT_EQ(overlap.partners[1].depth_mm, 0.3);
  EXPECT_EQ(overlap.partners[1].volume_mm3, 4);
}

}  // namespace
}  // namespace ccslice
