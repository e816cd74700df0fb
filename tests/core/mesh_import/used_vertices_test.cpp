// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/used_vertices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

/// A tetrahedron on the vertices 1, 2, 4 and 5 of six, each with two channels.
MeshFile six_vertices() {
  MeshFile file;
  for (int v = 0; v < 6; ++v) file.mesh.positions.emplace_back(v, 0, 0);
  file.mesh.channel_names = {"a", "b"};
  for (int v = 0; v < 6; ++v) file.mesh.channel_values.insert(file.mesh.channel_values.end(), {float(v), 10.0f + v});
  file.mesh.cell_kinds = {CellKind::kTet};
  file.mesh.cell_vertices = {5, 1, 2, 4};
  return file;
}

TEST(UsedVertices, StayInTheirOrderWithTheirChannels) {
  MeshFile file = six_vertices();
  EXPECT_THAT(used_vertices(file.mesh), ElementsAre(false, true, true, false, true, true));
  leave_out_unused_vertices({}, TextScanner(""), file);
  EXPECT_THAT(file.mesh.positions, ElementsAre(Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3(4, 0, 0), Vec3(5, 0, 0)));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 11, 2, 12, 4, 14, 5, 15));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(3, 0, 1, 2));
  EXPECT_THAT(file.warnings, ElementsAre("2 vertices that no cell uses left out; lists of vertices count the others"));
  leave_out_unused_vertices({}, TextScanner(""), file);
  EXPECT_EQ(file.warnings.size(), 1u) << "nothing was left to leave out";
}

TEST(UsedVertices, AreNotAllThatCellsUse) {
  MeshFile file = six_vertices();
  file.left_out_nodes = {3, 3};
  leave_out_unused_vertices({}, TextScanner(""), file);
  EXPECT_EQ(file.mesh.vertex_count(), 4u);
  EXPECT_THAT(file.warnings, ElementsAre("1 vertex that no cell uses left out; lists of vertices count the others"));
}

TEST(UsedVertices, AloneHaveToHaveFiniteNumbers) {
  MeshFile file = six_vertices();
  TextScanner scanner("nan\n1e39\n");
  UnfitNumbers unfit;
  unfit.coordinate(scanner.any_real(""), 3, "a coordinate", scanner);
  EXPECT_EQ(unfit.coordinate(1.5, 4, "a coordinate", scanner), 1.5);
  EXPECT_EQ(unfit.value(2.5, 4, "a value", scanner), 2.5f);
  EXPECT_NO_THROW(unfit.throw_if_used(used_vertices(file.mesh), {}, scanner));
  EXPECT_EQ(unfit.value(scanner.any_real(""), 4, "a value", scanner), std::numeric_limits<float>::infinity());
  file.numbers = {"node", "element", {7, 7, 7, 7, 900, 7}, {}};
  expect_error([&] { leave_out_unused_vertices(unfit, scanner, file); }, ErrorCode::kMeshNonFinite,
               "line 2: '1e39', a value of node 900, is not finite, or too large for a float");
  EXPECT_EQ(file.mesh.vertex_count(), 6u);
}

}  // namespace
}  // namespace ccslice
