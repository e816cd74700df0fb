// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/tiny_meshes.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/brute_force.h"

namespace ccslice::oracle {
namespace {

struct Census {
  std::map<std::size_t, int> interior, boundary;  // Edges by number of cells.
};

Census census(const ControlMesh& mesh) {
  const BruteMesh brute = to_brute_mesh(mesh);
  const BruteTopology topology = build_topology(brute.cells, brute.vertex_count());
  Census result;
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    ++(topology.edge_on_boundary(e) ? result.boundary : result.interior)[topology.edge_cells[e].size()];
  }
  return result;
}

TEST(TinyMeshes, HaveDistinctNames) {
  std::set<std::string> names;
  for (const TinyMesh& tiny : tiny_meshes()) EXPECT_TRUE(names.insert(tiny.name).second) << tiny.name;
  for (const InvalidMesh& invalid : invalid_meshes()) EXPECT_TRUE(names.insert(invalid.name).second) << invalid.name;
}

TEST(TinyMeshes, HaveTheFeaturesThatTheyAreNamedFor) {
  for (const int n : {3, 5, 6, 7}) {
    const std::string name = "edge_valence_" + std::to_string(n);
    EXPECT_EQ(census(tiny_mesh(name + "_layers_3")).interior[n], 3) << name;
    EXPECT_EQ(census(tiny_mesh(name + "_inside")).interior[n], 2) << name;
  }
  for (int k = 1; k <= 4; ++k) {
    EXPECT_GT(census(tiny_mesh("boundary_edge_" + std::to_string(k) + "_hexes")).boundary[k], 0) << k;
  }
  EXPECT_EQ(census(tiny_mesh("vertex_link_icosahedron")).interior[5], 12);
  EXPECT_EQ(census(tiny_mesh("vertex_link_capped_octahedron")).interior[3], 1);
  EXPECT_EQ(census(tiny_mesh("vertex_link_gyroelongated_6")).interior[6], 2);
  EXPECT_EQ(census(tiny_mesh("vertices_adjacent_cube_in_cube")).interior[3], 20);
  EXPECT_EQ(tiny_mesh("sharp_box").sharp_edges.size(), 36u);
  EXPECT_EQ(tiny_mesh("sharp_1_hex_chain_end").sharp_edges.size(), 2u);
  EXPECT_EQ(tiny_mesh("sharp_2_hexes_turn").sharp_edges.size(), 4u);
  EXPECT_EQ(tiny_mesh("sharp_3_hexes").sharp_edges.size(), 3u);
  EXPECT_EQ(tiny_mesh("tagged_on_sharp").sharp_vertices.size(), 2u);
}

TEST(TinyMeshes, HaveCornersOfPositiveVolume) {
  for (const TinyMesh& tiny : tiny_meshes()) {
    const BruteMesh mesh = to_brute_mesh(tiny.mesh);
    for (const BruteCell& cell : mesh.cells) {
      if (cell.kind != CellKind::kHex) continue;
      for (int b = 0; b < 8; ++b) {
        const Vec3 p = mesh.position(cell.v[kVtkCorner[b]]);
        Mat3 edges;
        for (int d = 0; d < 3; ++d) {
          edges.col(d) = (mesh.position(cell.v[kVtkCorner[b ^ (1 << d)]]) - p) * (b >> d & 1 ? -1 : 1);
        }
        EXPECT_GT(edges.determinant(), 1) << tiny.name;
      }
    }
  }
}

}  // namespace
}  // namespace ccslice::oracle
