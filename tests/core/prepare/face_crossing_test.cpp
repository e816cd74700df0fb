// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/face_crossing.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// How many pairs of faces of two cubes of 10 mm, the second one moved, reach into the other one's cell; the deepest.
struct Reaches {
  int count = 0;
  double depth_mm = 0;
};

Reaches reaches_of_cubes(const Vec3& offset) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const ControlMesh one = mesh;
  oracle::append_mesh(mesh, one, offset);
  const auto solid = prepare_solid(mesh);
  const BoundarySurface surface(*solid);
  CellProbe probe(*solid);
  FaceCrossing crossing(surface, probe);
  Reaches reaches;
  for (const BoundaryFaceId a : surface.face_ids()) {
    for (const BoundaryFaceId b : surface.face_ids()) {
      if (surface.faces()[a].cell == surface.faces()[b].cell || b < a) continue;
      const auto found = crossing.find(a, b);
      if (!found) continue;
      ++reaches.count;
      reaches.depth_mm = std::max(reaches.depth_mm, found->depth_mm);
      EXPECT_NE(found->cell, found->other);
      const Box3 cube(Vec3::Zero(), Vec3::Constant(10));
      EXPECT_LT(cube.exteriorDistance(found->position), 1e-9);
      EXPECT_LT(cube.exteriorDistance(found->position - offset), 1e-9);
      const auto again = crossing.find(a, b);
      EXPECT_TRUE(again && again->position == found->position);
    }
  }
  return reaches;
}

TEST(FaceCrossing, FindsFacesThatReachIntoEachOther) {
  for (const Vec3& offset : {Vec3(5, 3, 2), Vec3(9.98, 9.97, 4), Vec3(5, 0, 0), Vec3(9.98, 0, 0)}) {
    const Reaches found = reaches_of_cubes(offset);
    EXPECT_GT(found.count, 0) << offset.transpose();
    EXPECT_GT(found.depth_mm, kLeastOverlapMm);
    EXPECT_LT(found.depth_mm, (Vec3::Constant(10) - offset).minCoeff() + 1e-6) << offset.transpose();
  }
}

TEST(FaceCrossing, FindsNoneWhereTheyTouchOrAreApart) {
  for (const Vec3& offset :
       {Vec3(10, 0, 0), Vec3(10, 3, 4), Vec3(10, 10, 0), Vec3(10, 10, 10), Vec3(9.9995, 2, 2), Vec3(10.01, 0, 0)}) {
    EXPECT_EQ(reaches_of_cubes(offset).count, 0) << offset.transpose();
  }
}

}  // namespace
}  // namespace ccslice
