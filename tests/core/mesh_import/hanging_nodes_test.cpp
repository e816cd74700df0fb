// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/hanging_nodes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/mesh_import/join_points.h"
#include "core/mesh_import/split_touching.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;

/// Both meshes, with joined points, split where they touch.
ControlMesh put_together(ControlMesh mesh, const ControlMesh& other, const Vec3& offset) {
  const auto first = static_cast<std::uint32_t>(mesh.vertex_count());
  for (const Vec3& position : other.positions) mesh.positions.push_back(position + offset);
  for (const std::uint32_t vertex : other.cell_vertices) mesh.cell_vertices.push_back(first + vertex);
  mesh.cell_kinds.insert(mesh.cell_kinds.end(), other.cell_kinds.begin(), other.cell_kinds.end());
  FileNumbers numbers;
  join_points(1e-6, mesh, numbers);
  split_touching(mesh, numbers);
  return mesh;
}

HangingNodes find(const ControlMesh& mesh) { return find_hanging_nodes(mesh, make_cell_complex(mesh), 1e-6); }

TEST(HangingNodes, AreInTheMiddleOfEdgesOfLargerCells) {
  const HangingNodes found = find(put_together(box_mesh(1, 1, 1, 10), box_mesh(2, 2, 2, 5), Vec3(10, 0, 0)));
  EXPECT_EQ(found.edges, 4u);
  EXPECT_EQ(found.quadrilaterals, 0u);
  EXPECT_EQ(found.first.x(), 10);
}

TEST(HangingNodes, AreAlsoThoseOnACurvedSurface) {
  ControlMesh small = box_mesh(2, 2, 2, 5);
  for (Vec3& p : small.positions) {
    if (p.x() == 0) p.x() = 0.08 * (std::abs(p.y() - 5) - 5 + std::abs(p.z() - 5) - 5);
  }
  EXPECT_EQ(find(put_together(box_mesh(1, 1, 1, 10), small, Vec3(10, 0, 0))).edges, 4u);
}

TEST(HangingNodes, AreFoundWhereTrianglesLieOnAQuadrilateral) {
  const HangingNodes found = find(put_together(box_mesh(1, 1, 1, 10), oracle::kuhn_box(1), Vec3(10, 0, 0)));
  EXPECT_EQ(found.quadrilaterals, 1u);
  EXPECT_EQ(found.first, Vec3(10, 5, 5));
}

// The two short edges of a hole with a triangular section lie as those at a hanging node do, but hang together with the
// long one.
TEST(HangingNodes, AreNotRoundAHole) {
  ControlMesh mesh;
  for (const double y : {0.0, 5.0}) {
    for (const auto& [x, z] : {std::pair(0, 0), {10, 0}, {5, 1}, {0, -5}, {10, -5}, {0, 6}, {5, 6}, {10, 6}}) {
      mesh.positions.push_back(Vec3(x, y, z));
    }
  }
  const auto add = [&](std::array<std::uint32_t, 4> section) {
    for (const std::uint32_t v : section) mesh.cell_vertices.push_back(v);
    for (const std::uint32_t v : section) mesh.cell_vertices.push_back(v + 8);
    mesh.cell_kinds.push_back(CellKind::kHex);
  };
  add({3, 4, 1, 0});
  add({0, 2, 6, 5});
  add({2, 1, 7, 6});
  EXPECT_FALSE(find(mesh).any());
  for (Vec3& p : mesh.positions) p.z() = p.z() == 1 ? 0 : p.z();
  mesh.positions.insert(mesh.positions.end(), {Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(0, 5, 0), Vec3(10, 5, 0)});
  for (std::size_t i = 0; i < 8; ++i) {  // The lower cell gets corners of its own.
    std::uint32_t& v = mesh.cell_vertices[i];
    v = v == 0 ? 16 : v == 1 ? 17 : v == 8 ? 18 : v == 9 ? 19 : v;
  }
  EXPECT_EQ(find(mesh).edges, 2u);
}

TEST(HangingNodes, AreNotInMeshesOfOtherKinds) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) EXPECT_FALSE(find(mesh).any()) << name;
  const auto two = [](int x, int y, int) { return x == y; };
  EXPECT_FALSE(find(put_together(box_mesh(2, 2, 1, 10, two), box_mesh(1, 1, 1), Vec3(0, 0, 50))).any()) << "voxels";
}

}  // namespace
}  // namespace ccslice
