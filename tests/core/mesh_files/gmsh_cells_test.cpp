// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const GmshElementType& gmsh_type(std::uint16_t number) {
  return *std::ranges::find(kGmshElementTypes, number, &GmshElementType::number);
}

std::vector<std::uint64_t> tags_from(std::uint64_t first, std::size_t count) {
  std::vector<std::uint64_t> tags(count);
  std::iota(tags.begin(), tags.end(), first);
  return tags;
}

/// Nodes of the tags 100 to 149, the last one first.
NodeNumbers fifty_nodes() {
  NodeNumbers nodes;
  for (std::uint64_t tag = 149; tag >= 100; --tag) nodes.add(tag, 0);
  EXPECT_FALSE(nodes.sort());
  return nodes;
}

TEST(GmshCells, DropTheLastOneWithAllThatItBrought) {
  GmshCells cells;
  cells.add(gmsh_type(11), 7, tags_from(100, 10), 1);
  EXPECT_FALSE(cells.last_is_twin());
  cells.add(gmsh_type(11), 8, tags_from(100, 10), 2);
  EXPECT_TRUE(cells.last_is_twin());
  cells.drop_last();
  cells.add(gmsh_type(29), 9, tags_from(100, 20), 3);
  EXPECT_TRUE(cells.last_is_twin()) << "the corners are the same";
  cells.drop_last();
  EXPECT_EQ(cells.size(), 1u);
  MeshFile file;
  cells.connect(fifty_nodes(), TextScanner(""), file);
  EXPECT_THAT(file.numbers.cells, ElementsAre(7));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(49, 48, 47, 46));
  EXPECT_THAT(file.second_order.cells, ElementsAre(0));
  EXPECT_THAT(file.left_out_nodes, IsEmpty());
  EXPECT_THAT(file.second_order.nodes, ElementsAre(45, 44, 43, 42, 40, 41)) << "Gmsh has edge 2-3 before 1-3";
  EXPECT_TRUE(file.warnings.empty());
}

TEST(GmshCells, KeepNodesOfSecondOrderOnly) {
  GmshCells cells;
  cells.add(gmsh_type(5), 1, tags_from(100, 8), 1);
  cells.add(gmsh_type(30), 2, tags_from(100, 35), 2);
  cells.add(gmsh_type(18), 3, tags_from(100, 15), 3);
  MeshFile file;
  cells.connect(fifty_nodes(), TextScanner(""), file);
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kHex, CellKind::kTet, CellKind::kWedge));
  EXPECT_THAT(file.second_order.cells, ElementsAre(2));
  EXPECT_EQ(file.second_order.nodes.size(), 9u);
  EXPECT_EQ(file.left_out_nodes.size(), 31u) << "of 35, and 4 are corners";
  EXPECT_THAT(file.warnings, ElementsAre("1 cell of third order or higher taken by their corners: curved edges become "
                                         "straight. Nodes of second order can be kept: save the mesh with `gmsh -order "
                                         "2`"));
  GmshCells straight;
  straight.add(gmsh_type(5), 1, tags_from(100, 8), 1);
  MeshFile without;
  straight.connect(fifty_nodes(), TextScanner(""), without);
  EXPECT_THAT(without.warnings, IsEmpty());
}

TEST(GmshCells, RefuseNodesThatAreNotThere) {
  GmshCells cells;
  cells.add(gmsh_type(11), 7, tags_from(141, 10), 12);
  MeshFile file;
  expect_error([&] { cells.connect(fifty_nodes(), TextScanner(""), file); }, ErrorCode::kMeshIndexOutOfRange,
               "line 12: a cell uses node 150, which the file doesn't have");
}

}  // namespace
}  // namespace ccslice
