// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/medit_high_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "core/mesh_files/read_medit.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

/// A brick of 2 x 4 x 6, whose nodes of order `order` are in the order of their indices (i, j, k), i first.
std::vector<std::array<int, 3>> lattice(int order) {
  std::vector<std::array<int, 3>> indices;
  for (int k = 0; k <= order; ++k) {
    for (int j = 0; j <= order; ++j) {
      for (int i = 0; i <= order; ++i) indices.push_back({i, j, k});
    }
  }
  return indices;
}

std::string vertices_of(const std::vector<std::array<int, 3>>& indices, int order) {
  std::string text = "MeshVersionFormatted 2\nDimension 3\nVertices\n" + std::to_string(indices.size()) + "\n";
  for (const auto& [i, j, k] : indices) {
    text += std::to_string(2.0 * i / order) + " " + std::to_string(4.0 * j / order) + " " +
            std::to_string(6.0 * k / order) + " 0\n";
  }
  return text;
}

std::string numbers(const std::vector<int>& values) {
  std::string text;
  for (const int value : values) text += std::to_string(value) + " ";
  return text;
}

/// Where the corners of a hexahedron and the nodes between them have to be.
void expect_brick(const MeshFile& file) {
  ASSERT_EQ(file.mesh.vertex_count(), 8u);
  EXPECT_EQ(file.mesh.positions[file.mesh.cell_vertices[6]], Vec3(2, 4, 6));
  EXPECT_EQ(file.mesh.positions[file.mesh.cell_vertices[1]], Vec3(2, 0, 0));
  const MidNodes& nodes = file.mesh.mid_nodes;
  ASSERT_EQ(nodes.edges.size(), 12u);
  ASSERT_EQ(nodes.faces.size(), 6u);
  for (std::size_t e = 0; e < 12; ++e) {
    const auto [a, b] = nodes.edges[e];
    EXPECT_EQ(nodes.positions[e], (file.mesh.positions[a] + file.mesh.positions[b]) / 2) << a << "-" << b;
  }
  for (std::size_t f = 0; f < 6; ++f) {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t corner : nodes.faces[f]) sum += file.mesh.positions[corner];
    EXPECT_EQ(nodes.positions[12 + f], sum / 4) << f;
  }
  EXPECT_EQ(nodes.positions.back(), Vec3(1, 2, 3));
}

TEST(MeditHighOrder, TakesTheOrderThatTheFileLists) {
  const auto indices = lattice(2);
  std::vector<int> all(27);
  std::iota(all.begin(), all.end(), 1);
  std::string ordering = "HexahedraQ2Ordering\n27\n";
  for (const auto& [i, j, k] : indices) ordering += numbers({i, j, k}) + "\n";
  const std::string cells = "HexahedraQ2\n1\n" + numbers(all) + "5\n";
  for (const std::string& text : {ordering + cells, cells + ordering}) {
    const MeshFile file = read_medit(vertices_of(indices, 2) + text + "End\n");
    expect_brick(file);
    EXPECT_TRUE(file.warnings.empty());
    EXPECT_EQ(file.cell_numbers[0].of_cells[0], 5);
  }
}

TEST(MeditHighOrder, TellsNodesByTheirPlacesWhereNoOrderIsListed) {
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 random(kSeed);
  const auto indices = lattice(2);
  const auto at = [&](int i, int j, int k) { return 1 + i + 3 * j + 9 * k; };
  const std::vector<int> corners = {at(0, 0, 0), at(2, 0, 0), at(2, 2, 0), at(0, 2, 0),
                                    at(0, 0, 2), at(2, 0, 2), at(2, 2, 2), at(0, 2, 2)};
  for (int round = 0; round < 20; ++round) {
    std::vector<int> others;
    for (int n = 1; n <= 27; ++n) {
      if (std::ranges::find(corners, n) == corners.end()) others.push_back(n);
    }
    std::ranges::shuffle(others, random);
    expect_brick(read_medit(vertices_of(indices, 2) + "HexahedraQ2 1\n" + numbers(corners) + numbers(others) + "0\n"));
  }
}

TEST(MeditHighOrder, TakesTetrahedraAndPrismsInTheirOrderings) {
  // Corners last, the apex first among them.
  const std::string tet =
      "MeshVersionFormatted 2\nVertices 10\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n0 1 1 0\n0 0 2 0\n0 0 0 0\n"
      "2 0 0 0\n0 2 0 0\nTetrahedraP2Ordering 10\n1 1 0 0\n0 1 1 0\n1 0 1 0\n1 0 0 1\n0 1 0 1\n0 0 1 1\n0 0 0 2\n"
      "2 0 0 0\n0 2 0 0\n0 0 2 0\nTetrahedraP2 1\n1 2 3 4 5 6 7 8 9 10 0\n";
  const MeshFile file = read_medit(tet);
  ASSERT_EQ(file.mesh.vertex_count(), 4u);
  std::vector<Vec3> corners;
  for (const std::uint32_t vertex : file.mesh.cell_vertices) corners.push_back(file.mesh.positions[vertex]);
  EXPECT_THAT(corners, ElementsAre(Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 2)));
  for (std::size_t e = 0; e < 6; ++e) {
    const auto [a, b] = file.mesh.mid_nodes.edges[e];
    EXPECT_EQ(file.mesh.mid_nodes.positions[e], (file.mesh.positions[a] + file.mesh.positions[b]) / 2);
  }

  std::string vertices, ordering, ids;
  int count = 0;
  for (int height = 2; height >= 0; --height) {
    for (int i = 0; i <= 2; ++i) {
      for (int j = 0; i + j <= 2; ++j) {
        vertices += numbers({j, 2 - i - j, 3 * height}) + "0\n";
        ordering += numbers({i, j, 2 - i - j, height}) + "\n";
        ids += std::to_string(++count) + " ";
      }
    }
  }
  const MeshFile prism = read_medit("MeshVersionFormatted 2\nVertices 18\n" + vertices + "PrismsP2Ordering 18\n" +
                                    ordering + "PrismsP2 1\n" + ids + "0\n");
  ASSERT_EQ(prism.mesh.vertex_count(), 6u);
  EXPECT_EQ(prism.mesh.positions[prism.mesh.cell_vertices[4]], Vec3(2, 0, 6));
  ASSERT_EQ(prism.mesh.mid_nodes.edges.size(), 9u);
  ASSERT_EQ(prism.mesh.mid_nodes.faces.size(), 3u);
  for (std::size_t f = 0; f < 3; ++f) {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t corner : prism.mesh.mid_nodes.faces[f]) sum += prism.mesh.positions[corner];
    EXPECT_EQ(prism.mesh.mid_nodes.positions[9 + f], sum / 4) << f;
  }
}

TEST(MeditHighOrder, TakesHigherOrdersByTheirCorners) {
  const auto indices = lattice(3);
  std::vector<int> all(64);
  std::iota(all.begin(), all.end(), 1);
  std::string ordering = "HexahedraQ3Ordering\n64\n";
  for (const auto& [i, j, k] : indices) ordering += numbers({i, j, k}) + "\n";
  const MeshFile file = read_medit(vertices_of(indices, 3) + ordering + "HexahedraQ3\n1\n" + numbers(all) + "0\n");
  ASSERT_EQ(file.mesh.vertex_count(), 8u);
  EXPECT_EQ(file.mesh.positions[file.mesh.cell_vertices[6]], Vec3(2, 4, 6));
  EXPECT_TRUE(file.mesh.mid_nodes.empty());
  EXPECT_THAT(file.warnings, ElementsAre("1 cell of third order or higher taken by their corners: curved edges become "
                                         "straight. Nodes of second order can be kept: save the mesh in second "
                                         "order"));
}

TEST(MeditHighOrder, RefusesOrderingsAndNodesThatAreNone) {
  const std::string vertices = "MeshVersionFormatted 2\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
  const auto expect = [&](const std::string& text, ErrorCode code, const std::string& part) {
    SCOPED_TRACE(part);
    expect_error([&] { (void)read_medit(vertices + text); }, code, part);
  };
  expect("TetrahedraP2Ordering 9\n", ErrorCode::kFileSyntax, "expected 10 nodes, found '9'");
  expect("TetrahedraP2Ordering 10\n3 0 0 0\n", ErrorCode::kFileSyntax, "indices of a node up to 2");
  expect("TetrahedraP2Ordering 10\n1 0 0 0\n", ErrorCode::kFileSyntax, "indices of a node up to 2");
  expect("PrismsP2Ordering 18\n1 0 0 2\n", ErrorCode::kFileSyntax, "indices of a node up to 2");
  std::string twice = "TetrahedraP2Ordering 10\n";
  for (int n = 0; n < 10; ++n) twice += "2 0 0 0\n";
  expect(twice, ErrorCode::kFileSyntax, "differ from node to node");
  expect("TetrahedraP2 1\n1 2 3 4 1 2 3 1 2 5 0\n", ErrorCode::kMeshIndexOutOfRange, "vertex id 5");
  expect_error(
      [&] {
        (void)read_medit("MeshVersionFormatted 2\nTetrahedraP2 1\n1 2 3 4 1 2 3 1 2 5 0\n" + vertices.substr(23));
      },
      ErrorCode::kMeshIndexOutOfRange, "cell 1 of TetrahedraP2 uses vertex 5; the file has 4");
  expect("PyramidsP2 2\n", ErrorCode::kMeshUnsupportedCell,
         "2 pyramids (1 to 2 of the section) aren't read; a pyramid");
  expect("Hexahedra12 1\n", ErrorCode::kMeshUnsupportedCell, "1 cells of Hexahedra12");
  expect("PolyhedraHeaders 1\n", ErrorCode::kMeshUnsupportedCell, "1 polyhedra");
  expect("Polyhedra 1\n", ErrorCode::kMeshUnsupportedCell, "1 polyhedra");
}

}  // namespace
}  // namespace ccslice
