// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_regions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/mesh/validate.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;
using oracle::with_regions;
using testing::IsEmpty;

SplitMesh split(ControlMesh mesh) {
  const ConnectedMesh checked = validate_and_connect(mesh, {}, {});
  return split_cell_regions(mesh, checked.complex);
}

ControlMesh two_cubes() {
  return with_regions(box_mesh(2, 1, 1), 2, [](const Vec3& p) { return p.x() < 10 ? 0 : 1; });
}

TEST(CellRegions, ArePartedAtInterfaces) {
  const SplitMesh two = split(two_cubes());
  EXPECT_EQ(two.mesh.vertex_count(), 16u);
  std::set<std::uint32_t> first(two.mesh.cell_vertices.begin(), two.mesh.cell_vertices.begin() + 8);
  std::set<std::uint32_t> second(two.mesh.cell_vertices.begin() + 8, two.mesh.cell_vertices.end());
  for (const std::uint32_t v : first) {
    EXPECT_FALSE(second.contains(v));
    EXPECT_EQ(two.origins[v], v);
  }
  for (std::uint32_t v = 0; v < 16; ++v) EXPECT_EQ(two.mesh.positions[v], two.mesh.positions[two.origins[v]]);
  ASSERT_EQ(two.interfaces.size(), 2u);
  EXPECT_EQ(two.interfaces[0].beyond, 1);
  EXPECT_EQ(two.interfaces[1].beyond, 0);
}

TEST(CellRegions, KeepTheRimOfAnInterfaceSharpInBoth) {
  const SplitMesh two = split(two_cubes());
  std::map<std::set<std::uint32_t>, int> copies;
  for (const auto& [a, b] : two.mesh.sharp_edges) ++copies[{two.origins[a], two.origins[b]}];
  EXPECT_EQ(copies.size(), 4u);
  for (const auto& [edge, count] : copies) EXPECT_EQ(count, 2);
  EXPECT_THAT(two.mesh.sharp_vertices, IsEmpty()) << "The rim is one closed curve.";
}

TEST(CellRegions, KeepCornersWhereInterfacesMeet) {
  const SplitMesh four = split(
      with_regions(box_mesh(2, 2, 1), 4, [](const Vec3& p) { return (p.x() < 10 ? 0 : 1) + (p.y() < 10 ? 0 : 2); }));
  EXPECT_EQ(four.mesh.vertex_count(), 32u);
  std::set<std::uint32_t> corners;
  for (const std::uint32_t v : four.mesh.sharp_vertices) corners.insert(four.origins[v]);
  // Both ends of the line in the middle, where five sharp edges meet.
  EXPECT_EQ(corners.size(), 2u);
  EXPECT_EQ(four.mesh.sharp_vertices.size(), 8u);
}

TEST(CellRegions, LeaveMeshesOfOneRegionAlone) {
  ControlMesh mesh = with_regions(box_mesh(2, 2, 2), 2, [](const Vec3&) { return 1; });
  EXPECT_FALSE(has_several_regions(mesh));
  EXPECT_FALSE(has_several_regions(box_mesh(2, 1, 1)));
  const SplitMesh whole = split(mesh);
  EXPECT_EQ(whole.mesh.vertex_count(), mesh.vertex_count());
  EXPECT_THAT(whole.mesh.sharp_edges, IsEmpty());
  EXPECT_THAT(whole.interfaces, IsEmpty());
}

TEST(CellRegions, AreSplitWherePiecesTouchInAVertexUnlessTheyGoRoundOthers) {
  // Two cubes on a diagonal in region 0, the other six in region 1.
  const ControlMesh mesh = with_regions(box_mesh(2, 2, 2), 2, [](const Vec3& p) {
    const int high = (p.x() > 10) + (p.y() > 10) + (p.z() > 10);
    return high == 0 || high == 3 ? 0 : 1;
  });
  expect_error([&] { split(mesh); }, ErrorCode::kMeshNonManifoldRegion, "at vertex 6");
  // Without the ring of six cells round the middle there is nothing wrong with them.
  const SplitMesh thirds = split(with_regions(box_mesh(2, 2, 2), 3, [](const Vec3& p) {
    const int high = (p.x() > 10) + (p.y() > 10) + (p.z() > 10);
    return high == 0 || high == 3 ? 0 : p.z() < 10 ? 1 : 2;
  }));
  EXPECT_EQ(thirds.mesh.cell_vertices.size(), 64u);
}

TEST(CellRegions, MayHavePiecesThatTouchAlongAnEdge) {
  const ControlMesh mesh =
      with_regions(box_mesh(2, 2, 1), 2, [](const Vec3& p) { return (p.x() < 10) == (p.y() < 10) ? 0 : 1; });
  const SplitMesh crossed = split(mesh);
  EXPECT_EQ(crossed.mesh.vertex_count(), 32u);
}

TEST(CellRegions, MayHaveSharpInterfaces) {
  ControlMesh mesh = with_regions(
      box_mesh(3, 3, 3), 2, [](const Vec3& p) { return (p - Vec3(15, 15, 15)).cwiseAbs().maxCoeff() < 5 ? 0 : 1; });
  const auto vertex_at = [&](const Vec3& p) {
    for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
      if ((mesh.positions[v] - p).norm() < 1e-9) return v;
    }
    return 0u;
  };
  mesh.sharp_edges = {{vertex_at({10, 10, 10}), vertex_at({20, 10, 10})}};
  mesh.sharp_vertices = {vertex_at({20, 20, 20})};
  const SplitMesh inside = split(mesh);
  EXPECT_EQ(inside.mesh.sharp_edges.size(), 2u);
  std::multiset<std::uint32_t> corners;
  for (const std::uint32_t v : inside.mesh.sharp_vertices) corners.insert(inside.origins[v]);
  EXPECT_EQ(corners.size(), 2u);
  mesh.cell_region_names.clear();
  mesh.cell_regions.clear();
  expect_error([&] { validate(mesh); }, ErrorCode::kMeshBadSharpFeature, "interface of cell regions");
}

}  // namespace
}  // namespace ccslice
