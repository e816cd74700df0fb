// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One bent house in all formats (tests/data/meshes/write_second_order.py): every node between corners has a place that
// no other one has, so it must belong to just that edge, face or cell.

#include "core/mesh_import/second_order_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/mid_nodes.h"

namespace ccslice {
namespace {

using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr double kRounding = 1e-14;

/// The corners of the house before it is bent.
const std::vector<Vec3> kCorners = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 4}, {4, 0, 4},
                                    {4, 4, 4}, {0, 4, 4}, {0, 2, 7}, {4, 2, 7}, {8, 2, 5}};

Vec3 bent(const Vec3& p) {
  return {p.x() + p.y() * p.y() / 32, p.y() + p.z() * p.z() / 32, p.z() + p.x() * p.x() / 32};
}

template <typename Corners>
Vec3 bent_middle(const Corners& corners) {
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t corner : corners) sum += kCorners.at(corner);
  return bent(sum / static_cast<double>(corners.size()));
}

MeshFile read_house(const std::string& name) {
  const std::string path = CCSLICE_TEST_DATA_DIR "/meshes/" + name;
  return read_mesh(read_file_bytes(path, 1 << 20), {}, {path});
}

class BentHouse : public testing::TestWithParam<const char*> {};

TEST_P(BentHouse, KeepsEveryNodeAtItsPlace) {
  const MeshFile file = read_house(GetParam());
  ASSERT_THAT(file.mesh.cell_kinds, testing::UnorderedElementsAre(CellKind::kHex, CellKind::kWedge, CellKind::kTet));
  ASSERT_EQ(file.mesh.vertex_count(), kCorners.size());
  for (std::size_t v = 0; v < kCorners.size(); ++v) {
    EXPECT_LT((file.mesh.positions[v] - bent(kCorners[v])).norm(), kRounding) << v;
  }
  const MidNodes& nodes = file.mesh.mid_nodes;
  ASSERT_EQ(nodes.edges.size(), 20u);
  ASSERT_EQ(nodes.faces.size(), 8u);
  ASSERT_EQ(nodes.cells.size(), 1u);
  std::size_t next = 0;
  for (const auto& edge : nodes.edges) {
    EXPECT_LT((nodes.positions[next++] - bent_middle(edge)).norm(), kRounding) << edge[0] << "-" << edge[1];
  }
  for (const auto& face : nodes.faces) {
    EXPECT_LT((nodes.positions[next++] - bent_middle(face)).norm(), kRounding) << testing::PrintToString(face);
  }
  EXPECT_EQ(file.mesh.cell_kinds[nodes.cells[0]], CellKind::kHex);
  EXPECT_LT((nodes.positions[next++] - bent(Vec3(2, 2, 2))).norm(), kRounding);
  EXPECT_EQ(next, nodes.positions.size());
}

TEST_P(BentHouse, SaysNothingOfNodesInDifferentPlaces) {
  const MeshFile file = read_house(GetParam());
  EXPECT_THAT(file.warnings, Each(Not(HasSubstr("several nodes"))));
  EXPECT_THAT(file.warnings, Each(Not(HasSubstr("no cell uses"))));
  ControlMesh mesh = file.mesh;
  EXPECT_NO_THROW(validate(mesh));
}

TEST_P(BentHouse, HasTheNumbersOfItsFile) {
  const FileNumbers numbers = read_house(GetParam()).numbers;
  ASSERT_EQ(numbers.vertices.size(), kCorners.size());
  const bool counts = std::string(GetParam()).ends_with(".mesh");
  for (std::size_t v = 0; v < kCorners.size(); ++v) EXPECT_EQ(numbers.vertices[v], counts ? v + 1 : 10 + 3 * v);
  EXPECT_EQ(numbers.vertex_noun, counts ? "vertex" : "node");
  EXPECT_EQ(numbers.cell_noun, counts ? "cell" : "element");
  if (counts) {
    EXPECT_THAT(numbers.cells, ElementsAre(1, 1, 1)) << "in their sections";
  } else {
    EXPECT_THAT(numbers.cells, ElementsAre(501, 502, 503));
  }
}

INSTANTIATE_TEST_SUITE_P(Readers, BentHouse,
                         testing::Values("second_order.inp", "second_order.msh", "second_order_binary.msh",
                                         "second_order.mesh", "second_order.e"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

TEST(SecondOrderCells, KeepTheChannelsOfTheirNodes) {
  const MeshFile file = read_house("second_order.msh");
  ASSERT_THAT(file.mesh.channel_names, ElementsAre("height"));
  ASSERT_EQ(file.mesh.mid_nodes.values.size(), 29u);
  for (std::size_t i = 0; i < 29; ++i) {
    EXPECT_EQ(file.mesh.mid_nodes.values[i], static_cast<float>(file.mesh.mid_nodes.positions[i].z())) << i;
  }
}

/// Repeated nodes are dropped on the way, which changes nothing of the result.
TEST(SecondOrderCells, ShareNodesHoweverManyTheyAre) {
  constexpr std::uint32_t kEdges = 50'000;
  MidNodeList list(1);
  for (int round = 0; round < 4; ++round) {
    for (std::uint32_t edge = 0; edge < kEdges; ++edge) {
      // Each edge has its own place in all rounds, but one of a thousand in the last one.
      const bool elsewhere = round == 3 && edge % 1000 == 7;
      const auto value = static_cast<float>(elsewhere ? -1.0 : edge);
      const Vec3 at(edge, elsewhere ? 0.5 : 0, 1);
      if (edge % 2 == 0) {
        list.add_edge({edge + 1, edge}, {at, std::span(&value, 1)});
      } else {
        list.add_face({edge + 3, edge, edge + 2, edge + 1}, {at, std::span(&value, 1)});
      }
    }
  }
  const MidNodeList::Result result = list.finish();
  EXPECT_EQ(result.conflicts.size(), kEdges / 1000);
  EXPECT_EQ(result.farthest_apart_mm, 0.5);
  ASSERT_EQ(result.nodes.edges.size(), kEdges / 2);
  ASSERT_EQ(result.nodes.faces.size(), kEdges / 2);
  ASSERT_EQ(result.nodes.positions.size(), kEdges);
  for (std::uint32_t i = 0; i < kEdges; ++i) {
    const std::uint32_t first = i < kEdges / 2 ? 2 * i : 2 * i - kEdges + 1;
    ASSERT_EQ(i < kEdges / 2 ? result.nodes.edges[i][0] : result.nodes.faces[i - kEdges / 2][0], first);
    ASSERT_EQ(result.nodes.positions[i], Vec3(first, 0, 1)) << "the first one counts";
    ASSERT_EQ(result.nodes.values[i], static_cast<float>(first));
  }
}

TEST(SecondOrderCells, ListTheirNodesOneAfterTheOther) {
  SecondOrderCells cells;
  add_second_order_cell(2, std::vector<std::uint32_t>{7, 8}, cells);
  add_second_order_cell(5, std::vector<std::uint32_t>{9}, cells);
  EXPECT_THAT(cells.cells, ElementsAre(2, 5));
  EXPECT_THAT(cells.first_nodes, ElementsAre(0, 2));
  EXPECT_THAT(cells.nodes, ElementsAre(7, 8, 9));
}

}  // namespace
}  // namespace ccslice
