// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/split_touching.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "core/mesh/connected_parts.h"
#include "core/mesh/region_values.h"
#include "core/mesh/validate.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

/// Every cell keeps its corners' places, and the mesh is a solid afterwards.
SplitReport expect_split(ControlMesh& mesh, FileNumbers* numbers = nullptr) {
  const ControlMesh before = mesh;
  FileNumbers none;
  const SplitReport report = split_touching(mesh, numbers != nullptr ? *numbers : none);
  EXPECT_EQ(mesh.vertex_count(), before.vertex_count() + report.new_vertices);
  EXPECT_EQ(mesh.cell_vertices.size(), before.cell_vertices.size());
  for (std::size_t i = 0; i < before.cell_vertices.size(); ++i) {
    EXPECT_EQ(mesh.positions[mesh.cell_vertices[i]], before.positions[before.cell_vertices[i]]);
  }
  ControlMesh checked = mesh;
  EXPECT_NO_THROW(validate(checked));
  return report;
}

/// Two voxels that have an edge in common.
ControlMesh two_in_an_edge() {
  return box_mesh(2, 2, 1, 10, [](int x, int y, int) { return x == y; });
}

TEST(SplitTouching, GivesEachOfTwoVoxelsAnEdgeOfItsOwn) {
  ControlMesh mesh = two_in_an_edge();
  ControlMesh refused = mesh;
  expect_error([&] { validate(refused); }, ErrorCode::kMeshNonManifoldEdge, "isn't manifold");
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.edges, 1u);
  EXPECT_EQ(report.vertices, 0u);
  EXPECT_EQ(report.faces, 0u);
  EXPECT_EQ(report.new_vertices, 2u);
  EXPECT_EQ(report.first, Vec3(10, 10, 5));
  EXPECT_EQ(count_parts(mesh).count, 2u);
  EXPECT_EQ(count_parts(mesh).of_one_cell, 2u);
}

TEST(SplitTouching, GivesEachOfTwoVoxelsAVertexOfItsOwn) {
  ControlMesh mesh = box_mesh(2, 2, 2, 10, [](int x, int y, int z) { return x == y && y == z; });
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.edges, 0u);
  EXPECT_EQ(report.vertices, 1u);
  EXPECT_EQ(report.new_vertices, 1u);
  EXPECT_EQ(report.first, Vec3(10, 10, 10));
}

TEST(SplitTouching, LeavesASolidAlone) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    ControlMesh split = mesh;
    FileNumbers numbers;
    const SplitReport report = split_touching(split, numbers);
    EXPECT_EQ(report.edges + report.vertices + report.new_vertices, 0u) << name;
    EXPECT_EQ(split.cell_vertices, mesh.cell_vertices) << name;
    EXPECT_EQ(split.positions, mesh.positions) << name;
  }
}

TEST(SplitTouching, PartsAnEdgeAtOneEndWhereFacesJoinItsCellsAtTheOther) {
  // Two voxels touch in an upright edge, on a layer that joins them.
  ControlMesh mesh = box_mesh(2, 2, 2, 10, [](int x, int y, int z) { return z == 0 || x == y; });
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.edges, 1u);
  EXPECT_EQ(report.faces, 0u);
  EXPECT_EQ(report.new_vertices, 1u) << "only the upper end";
  EXPECT_EQ(count_parts(mesh).count, 1u);
}

TEST(SplitTouching, CutsAFaceWhereCavitiesTouchInAnEdge) {
  ControlMesh mesh =
      box_mesh(4, 4, 3, 10, [](int x, int y, int z) { return z != 1 || x + y != 3 || x == 0 || y == 0; });
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.edges, 1u);
  EXPECT_EQ(report.faces, 1u) << "one voxel and the one beside it share a face at one end of the edge no more";
  EXPECT_EQ(report.new_vertices, 1u);
  EXPECT_EQ(count_parts(mesh).count, 1u);
}

TEST(SplitTouching, CutsTwoFacesWhereCavitiesTouchInAVertex) {
  ControlMesh mesh = box_mesh(4, 4, 4, 10, [](int x, int y, int z) { return x != y || y != z || x == 0 || x == 3; });
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.edges, 0u);
  EXPECT_EQ(report.vertices, 1u);
  EXPECT_EQ(report.faces, 2u);
  EXPECT_EQ(report.new_vertices, 1u);
}

TEST(SplitTouching, PartsAFaceWhollyWhereItReachesTheBoundary) {
  ControlMesh mesh = box_mesh(2, 2, 3, 10, [](int x, int y, int z) { return z != 1 || x == y; });
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.edges, 1u);
  EXPECT_EQ(report.faces, 1u);
  EXPECT_EQ(report.new_vertices, 4u);
  EXPECT_EQ(count_parts(mesh).count, 1u);
}

TEST(SplitTouching, MakesASolidOfAnyVoxels) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    const double share = 0.2 + 0.015 * seed;
    ControlMesh mesh =
        box_mesh(6, 5, 4, 1, [&](int, int, int) { return std::uniform_real_distribution<double>()(random) < share; });
    SCOPED_TRACE("seed " + std::to_string(seed));
    expect_split(mesh);
  }
}

TEST(SplitTouching, MakesASolidOfTetrahedraThatAThresholdLeft) {
  const ControlMesh whole = oracle::kuhn_box(3);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    ControlMesh mesh;
    std::vector<std::uint32_t> numbers(whole.vertex_count(), 0xffffffffu);
    for (std::size_t cell = 0; cell < whole.cell_count(); ++cell) {
      if (random() % 2 == 0) continue;
      mesh.cell_kinds.push_back(whole.cell_kinds[cell]);
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint32_t v = whole.cell_vertices[4 * cell + i];
        if (numbers[v] == 0xffffffffu) {
          numbers[v] = static_cast<std::uint32_t>(mesh.vertex_count());
          mesh.positions.push_back(whole.positions[v]);
        }
        mesh.cell_vertices.push_back(numbers[v]);
      }
    }
    SCOPED_TRACE("seed " + std::to_string(seed));
    expect_split(mesh);
  }
}

// The second fan at a vertex is a band, which two cavities leave between them.
TEST(SplitTouching, CutsEveryFanThatIsNoDisc) {
  ControlMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 9}, {0, 1, 9}, {-1, -1, 9}};
  for (int i = 0; i < 8; ++i) {  // Places above the equator and below it, in turns.
    const double angle = i * std::numbers::pi / 4;
    mesh.positions.emplace_back(5 * std::cos(angle), 5 * std::sin(angle), i % 2 == 0 ? 3 : -3);
  }
  mesh.cell_vertices = {0, 1, 2, 3};
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t next = 4 + (i + 1) % 8, last = 4 + (i + 2) % 8;
    const auto band = i % 2 == 0 ? std::array{0u, 4 + i, next, last} : std::array{0u, 4 + i, last, next};
    mesh.cell_vertices.insert(mesh.cell_vertices.end(), band.begin(), band.end());
  }
  mesh.cell_kinds.assign(9, CellKind::kTet);
  const SplitReport report = expect_split(mesh);
  EXPECT_EQ(report.vertices, 1u);
  EXPECT_EQ(report.faces, 2u);
  EXPECT_EQ(mesh.cell_vertices[0], 0u) << "the first fan keeps the vertex";
}

TEST(SplitTouching, TakesTagsValuesAndNumbersAlong) {
  ControlMesh mesh = two_in_an_edge();
  mesh.channel_names = {"t"};
  FileNumbers numbers;
  std::uint32_t low = 0, high = 0;  // The ends of the common edge.
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    mesh.channel_values.push_back(static_cast<float>(v));
    numbers.vertices.push_back(100 + v);
    if (mesh.positions[v] == Vec3(10, 10, 0)) low = v;
    if (mesh.positions[v] == Vec3(10, 10, 10)) high = v;
  }
  const auto first_copy = static_cast<std::uint32_t>(mesh.vertex_count());
  mesh.sharp_edges = {{low, high}};
  mesh.sharp_vertices = {low};
  mesh.interpolating = true;
  mesh.missed_vertices = {{high, Vec3(1, 2, 3)}};
  expect_split(mesh, &numbers);
  EXPECT_THAT(mesh.sharp_edges, UnorderedElementsAre(testing::UnorderedElementsAre(low, high),
                                                     testing::UnorderedElementsAre(first_copy, first_copy + 1)));
  EXPECT_EQ(mesh.sharp_vertices.size(), 2u);
  ASSERT_EQ(mesh.missed_vertices.size(), 2u);
  EXPECT_EQ(mesh.missed_vertices[1].position, Vec3(1, 2, 3));
  EXPECT_THAT(std::set<std::uint64_t>(numbers.vertices.begin() + first_copy, numbers.vertices.end()),
              ElementsAre(100 + low, 100 + high));
  for (std::uint32_t v = first_copy; v < mesh.vertex_count(); ++v) {
    EXPECT_EQ(mesh.channel_values[v], static_cast<float>(numbers.vertices[v] - 100));
  }
}

TEST(SplitTouching, GivesCopiesTheValuesOfTheirRegion) {
  ControlMesh mesh = two_in_an_edge();
  mesh.channel_names = {"t"};
  mesh.channel_values.assign(mesh.vertex_count(), 1);
  mesh.cell_region_names = {"a", "b"};
  mesh.cell_regions = {0, 1};
  std::vector<std::uint32_t> common;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.positions[v].head<2>() == Eigen::Vector2d(10, 10)) common.push_back(v);
  }
  const float seven = 7;
  for (const std::uint32_t v : common) append_region_values(v, 1, {&seven, 1}, mesh);
  expect_split(mesh);
  EXPECT_EQ(region_value_count(mesh), 0u) << "no interface is left";
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(mesh.channel_values[mesh.cell_vertices[i]], 1) << i;
    const std::uint32_t v = mesh.cell_vertices[8 + i];
    EXPECT_EQ(mesh.channel_values[v], mesh.positions[v].head<2>() == Eigen::Vector2d(10, 10) ? 7 : 1) << i;
  }
}

TEST(SplitTouching, GivesBothSidesTheirMidNodes) {
  ControlMesh mesh = two_in_an_edge();
  std::set<std::array<std::uint32_t, 2>> edges;
  for (std::size_t cell = 0; cell < 2; ++cell) {
    for (const auto& [i, j] :
         {std::array{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}) {
      const std::uint32_t a = mesh.cell_vertices[8 * cell + static_cast<std::size_t>(i)];
      const std::uint32_t b = mesh.cell_vertices[8 * cell + static_cast<std::size_t>(j)];
      edges.insert({std::min(a, b), std::max(a, b)});
    }
  }
  for (const auto& edge : edges) {
    mesh.mid_nodes.edges.push_back(edge);
    mesh.mid_nodes.positions.push_back((mesh.positions[edge[0]] + mesh.positions[edge[1]]) / 2);
  }
  mesh.mid_nodes.cells = {1};
  mesh.mid_nodes.positions.push_back(Vec3(15, 15, 5));
  EXPECT_EQ(edges.size(), 23u);
  FileNumbers numbers;
  for (std::uint64_t node = 0; node < 24; ++node) numbers.mid_nodes.push_back(100 + node);
  const MidNodes before = mesh.mid_nodes;
  expect_split(mesh, &numbers);
  ASSERT_EQ(numbers.mid_nodes.size(), 25u);
  for (std::size_t i = 0; i < 25; ++i) {
    EXPECT_EQ(before.positions[numbers.mid_nodes[i] - 100], mesh.mid_nodes.positions[i]);
  }
  ASSERT_EQ(mesh.mid_nodes.edges.size(), 24u);
  for (std::size_t i = 0; i < 24; ++i) {
    const auto& [a, b] = mesh.mid_nodes.edges[i];
    EXPECT_EQ(mesh.mid_nodes.positions[i], Vec3((mesh.positions[a] + mesh.positions[b]) / 2));
  }
  EXPECT_THAT(mesh.mid_nodes.cells, ElementsAre(1));
  EXPECT_EQ(mesh.mid_nodes.positions.back(), Vec3(15, 15, 5));
}

TEST(SplitTouching, LeavesOtherFaultsToValidation) {
  ControlMesh mesh = two_in_an_edge();
  mesh.cell_vertices[0] = 1000;
  FileNumbers numbers;
  expect_error([&] { split_touching(mesh, numbers); }, ErrorCode::kMeshIndexOutOfRange, "out of range");
}

TEST(SplitTouching, TakesTimeInProportionToTheCells) {
  const auto seconds = [](int cells) {
    std::mt19937 random(3);
    ControlMesh mesh = box_mesh(cells, cells, cells, 1, [&](int, int, int) { return random() % 2 == 0; });
    FileNumbers numbers;
    const auto start = std::chrono::steady_clock::now();
    EXPECT_GT(split_touching(mesh, numbers).edges, 0u);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const double small = seconds(16), large = seconds(32);
  EXPECT_LT(large, 40 * small) << "8 times as many";
}

}  // namespace
}  // namespace ccslice
