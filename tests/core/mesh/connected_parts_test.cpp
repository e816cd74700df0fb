// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/connected_parts.h"

#include <gtest/gtest.h>

#include "tests/core/mesh/own_points.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;

TEST(ConnectedParts, AreCountedWithThoseOfOneCell) {
  const ControlMesh own = with_own_points(box_mesh(3, 1, 1));
  EXPECT_EQ(count_parts(own).count, 3u);
  EXPECT_EQ(count_parts(own).of_one_cell, 3u);
  const ControlMesh row = box_mesh(4, 1, 1, 10, [](int x, int, int) { return x != 1; });
  EXPECT_EQ(count_parts(row).count, 2u);
  EXPECT_EQ(count_parts(row).of_one_cell, 1u);
  EXPECT_EQ(count_parts({}).count, 0u);
}

TEST(ConnectedParts, AreNearWhereTheirPointsAre) {
  ControlMesh mesh = with_own_points(box_mesh(3, 1, 1));
  for (std::size_t i = 8; i < 16; ++i) mesh.positions[i].y() += 0.001;
  for (std::size_t i = 16; i < 24; ++i) mesh.positions[i].y() += 0.0015;
  const NearParts near = find_near_parts(mesh, 0.01);
  EXPECT_EQ(near.count, 1u);
  EXPECT_NEAR(near.apart_mm, 0.001, 1e-12);
  EXPECT_EQ(find_near_parts(mesh, 1e-4).count, 3u);
}

}  // namespace
}  // namespace ccslice
