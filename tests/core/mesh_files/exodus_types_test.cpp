// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/exodus_types.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "core/mesh_import/mid_nodes.h"

namespace ccslice {
namespace {

/// A row of SEACAS's tables: the corners of an edge or face, and the node between them, all from 0.
using Row = std::pair<std::vector<int>, int>;

const std::vector<Row> kHexEdges = {{{0, 1}, 8},  {{1, 2}, 9},  {{2, 3}, 10}, {{3, 0}, 11}, {{4, 5}, 16}, {{5, 6}, 17},
                                    {{6, 7}, 18}, {{7, 4}, 19}, {{0, 4}, 12}, {{1, 5}, 13}, {{2, 6}, 14}, {{3, 7}, 15}};
const std::vector<Row> kHexFaces = {{{0, 1, 5, 4}, 25}, {{1, 2, 6, 5}, 24}, {{2, 3, 7, 6}, 26},
                                    {{0, 4, 7, 3}, 23}, {{0, 3, 2, 1}, 21}, {{4, 5, 6, 7}, 22}};
const std::vector<Row> kWedgeEdges = {{{0, 1}, 6},  {{1, 2}, 7}, {{2, 0}, 8},  {{3, 4}, 12}, {{4, 5}, 13},
                                      {{5, 3}, 14}, {{0, 3}, 9}, {{1, 4}, 10}, {{2, 5}, 11}};
const std::vector<Row> kTetEdges = {{{0, 1}, 4}, {{1, 2}, 5}, {{2, 0}, 6}, {{0, 3}, 7}, {{1, 3}, 8}, {{2, 3}, 9}};

template <typename Corners>
int node_of(const std::vector<Row>& rows, const Corners& corners) {
  for (const auto& [of_row, node] : rows) {
    if (std::ranges::is_permutation(of_row, std::vector<int>(corners.begin(), corners.end()))) return node;
  }
  return exodus_tables::kNo;
}

void expect_nodes(CellKind kind, std::uint64_t nodes, const std::vector<Row>& edges, const std::vector<Row>& faces) {
  SCOPED_TRACE(nodes);
  const std::span<const std::uint8_t> places = exodus_mid_nodes(kind, nodes);
  std::size_t next = 0;
  for (const auto& edge : mid_edges(kind)) {
    ASSERT_LT(next, places.size());
    EXPECT_EQ(places[next++], node_of(edges, edge)) << "edge " << int{edge[0]} << "-" << int{edge[1]};
  }
  for (const auto& face : mid_faces(kind)) {
    if (faces.empty()) break;
    ASSERT_LT(next, places.size());
    EXPECT_EQ(places[next++], node_of(faces, face)) << testing::PrintToString(face);
  }
  EXPECT_EQ(places.size(), next + (nodes == 27 ? 1 : 0));
}

TEST(ExodusTypes, HaveNodesWhereSeacasHasThem) {
  expect_nodes(CellKind::kHex, 20, kHexEdges, {});
  expect_nodes(CellKind::kHex, 27, kHexEdges, kHexFaces);
  EXPECT_EQ(exodus_mid_nodes(CellKind::kHex, 27).back(), 20) << "inside";
  for (const std::uint64_t nodes : {15, 16}) expect_nodes(CellKind::kWedge, nodes, kWedgeEdges, {});
  expect_nodes(CellKind::kWedge, 18, kWedgeEdges, {{{0, 1, 4, 3}, 15}, {{1, 2, 5, 4}, 16}, {{0, 3, 5, 2}, 17}});
  expect_nodes(CellKind::kWedge, 20, kWedgeEdges, {{{0, 1, 4, 3}, 19}, {{1, 2, 5, 4}, 17}, {{0, 3, 5, 2}, 18}});
  expect_nodes(CellKind::kWedge, 21, kWedgeEdges, {{{0, 1, 4, 3}, 20}, {{1, 2, 5, 4}, 18}, {{0, 3, 5, 2}, 19}});
  for (const std::uint64_t nodes : {10, 11, 14, 15}) expect_nodes(CellKind::kTet, nodes, kTetEdges, {});
}

TEST(ExodusTypes, LackNodesAlongTheThirdAxis) {
  expect_nodes(
      CellKind::kHex, 16,
      {{{0, 1}, 8}, {{1, 2}, 9}, {{2, 3}, 10}, {{3, 0}, 11}, {{4, 5}, 12}, {{5, 6}, 13}, {{6, 7}, 14}, {{7, 4}, 15}},
      {});
  expect_nodes(CellKind::kWedge, 12, {{{0, 1}, 6}, {{1, 2}, 7}, {{2, 0}, 8}, {{3, 4}, 9}, {{4, 5}, 10}, {{5, 3}, 11}},
               {});
}

TEST(ExodusTypes, HaveNoneInOtherOrders) {
  for (const std::uint64_t nodes : {8, 9, 32, 64}) EXPECT_TRUE(exodus_mid_nodes(CellKind::kHex, nodes).empty());
  for (const std::uint64_t nodes : {6, 7, 24, 52}) EXPECT_TRUE(exodus_mid_nodes(CellKind::kWedge, nodes).empty());
  for (const std::uint64_t nodes : {4, 5, 8, 16, 40}) EXPECT_TRUE(exodus_mid_nodes(CellKind::kTet, nodes).empty());
}

TEST(ExodusTypes, AreToldByTheirNames) {
  EXPECT_EQ(exodus_element_type("hex27")->kind, CellKind::kHex);
  EXPECT_EQ(exodus_element_type("TETRA10")->kind, CellKind::kTet);
  EXPECT_EQ(exodus_element_type("HEXSHELL"), nullptr);
  EXPECT_EQ(exodus_element_type("NSIDED"), nullptr);
}

}  // namespace
}  // namespace ccslice
