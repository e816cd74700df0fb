// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_authoring/sharpen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/validate.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;
using testing::ElementsAre;

ControlMesh validated(ControlMesh mesh) {
  validate(mesh);
  return mesh;
}

/// Two by two by two cubes without one. Twelve outer edges of two, less the three that end at the missing corner; round
/// the notch six convex edges and three reentrant ones.
ControlMesh notched_box() {
  return box_mesh(2, 2, 2, 10, [](int i, int j, int k) { return i + j + k < 3; });
}

TEST(Sharpen, FindsTheEdgesOfABox) {
  const ControlMesh mesh = validated(box_mesh(3, 2, 2));
  EXPECT_EQ(find_sharp_edges(mesh, 90).convex.size(), 4u * 3 + 4 * 2 + 4 * 2);
  EXPECT_EQ(find_sharp_edges(mesh, 30).convex.size(), 28u);
  EXPECT_TRUE(find_sharp_edges(mesh, 90.1).convex.empty());
  EXPECT_TRUE(find_sharp_edges(mesh, 1).reentrant.empty());
}

TEST(Sharpen, TellsReentrantEdgesFromConvexOnes) {
  const ControlMesh mesh = validated(notched_box());
  const SharpEdges found = find_sharp_edges(mesh, 40);
  EXPECT_EQ(found.reentrant.size(), 3u);
  EXPECT_EQ(found.convex.size(), 24u - 3 + 6);
  for (const auto& [a, b] : found.reentrant) {
    EXPECT_LT(a, b);
    const Vec3 middle = 0.5 * (mesh.positions[a] + mesh.positions[b]);
    EXPECT_EQ((middle.array() == 10).count(), 2) << "the notch's edges end at the middle of the box";
  }
}

TEST(Sharpen, MeasuresTheAngleByWhichTheSurfaceTurns) {
  EXPECT_EQ(find_sharp_edges(validated(oracle::tiny_mesh("single_tet")), 60).convex.size(), 6u);
  ControlMesh roof = box_mesh(2, 1, 1);
  for (Vec3& p : roof.positions) {
    if (p.x() == 10 && p.z() == 10) p.z() = 15;  // A ridge whose sides rise by atan(1/2) = 26.57 degrees.
  }
  roof = validated(roof);
  EXPECT_EQ(find_sharp_edges(roof, 53.1).convex.size(), find_sharp_edges(roof, 60).convex.size() + 1);
  for (Vec3& p : roof.positions) {
    if (p.z() == 15) p.z() = 5;  // A valley.
  }
  EXPECT_EQ(find_sharp_edges(roof, 53.1).reentrant.size(), 1u);
  EXPECT_TRUE(find_sharp_edges(roof, 53.2).reentrant.empty());
}

TEST(Sharpen, WorksForAllCellsEitherHandedness) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    ControlMesh mirrored = mesh;
    for (Vec3& p : mirrored.positions) p.x() = -p.x();
    const SharpEdges found = find_sharp_edges(validated(mesh), 40);
    const SharpEdges in_mirror = find_sharp_edges(validated(mirrored), 40);
    EXPECT_EQ(found.convex, in_mirror.convex) << name;
    EXPECT_EQ(found.reentrant, in_mirror.reentrant) << name;
    ControlMesh sharp = mesh;
    add_sharp_features({found.convex, {}}, sharp);
    add_sharp_features({found.reentrant, {}}, sharp);
    EXPECT_NO_THROW(validate(sharp)) << name;
  }
}

TEST(Sharpen, ReadsEdgesAndCorners) {
  const SharpFeatures features = read_sharp_features("# edges\n4 1\n 1 2 # the rim\n\n7\n3 9\n");
  EXPECT_THAT(features.edges, ElementsAre(SharpEdge{1, 4}, SharpEdge{1, 2}, SharpEdge{3, 9}));
  EXPECT_THAT(features.vertices, ElementsAre(7u));
  EXPECT_THAT(read_sharp_features("5").vertices, ElementsAre(5u));
  EXPECT_TRUE(read_sharp_features("").edges.empty());
}

TEST(Sharpen, NamesLineAndTokenOfAList) {
  expect_error([] { read_sharp_features("1 2\n3 four\n"); }, ErrorCode::kFileSyntax,
               "line 2: expected a vertex id, found 'four'");
  expect_error([] { read_sharp_features("1 2 3\n"); }, ErrorCode::kFileSyntax, "line 1: expected one or two ids");
  expect_error([] { read_sharp_features("4294967296\n"); }, ErrorCode::kFileSyntax, "line 1: expected a vertex id");
}

TEST(Sharpen, TagsEachFeatureOnce) {
  ControlMesh mesh = box_mesh(1, 1, 1);
  mesh.sharp_edges = {{1, 0}};
  mesh.sharp_vertices = {3};
  add_sharp_features({{{0, 1}, {1, 2}, {1, 2}}, {3, 4, 4}}, mesh);
  EXPECT_THAT(mesh.sharp_edges, ElementsAre(SharpEdge{1, 0}, SharpEdge{1, 2}));
  EXPECT_THAT(mesh.sharp_vertices, ElementsAre(3u, 4u));
}

/// A cube of 27 cells whose middle one is another region.
TEST(Sharpen, KeepsEdgesOfInterfacesApart) {
  ControlMesh mesh = box_mesh(3, 3, 3);
  mesh.cell_region_names = {"core", "shell"};
  mesh.cell_regions.assign(27, 1);
  mesh.cell_regions[13] = 0;
  const SharpEdges found = find_sharp_edges(validated(mesh), 90);
  EXPECT_EQ(found.convex.size(), 36u);
  EXPECT_TRUE(found.reentrant.empty());
  EXPECT_EQ(found.interface.size(), 12u);
  add_sharp_features({found.interface, {}}, mesh);
  validate(mesh);
}

}  // namespace
}  // namespace ccslice
