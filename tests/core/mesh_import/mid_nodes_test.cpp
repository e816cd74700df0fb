// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/mid_nodes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/used_vertices.h"
#include "tests/support/finite_elements.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Two tetrahedra with a common face, and the nodes of the first one's six edges as further vertices.
MeshFile two_tetrahedra() {
  MeshFile file;
  file.mesh.positions = {Vec3(0, 0, 0), Vec3(6, 0, 0), Vec3(0, 6, 0), Vec3(0, 0, 6), Vec3(6, 6, 6)};
  file.mesh.cell_kinds = {CellKind::kTet, CellKind::kTet};
  file.mesh.cell_vertices = {0, 1, 2, 3, 1, 4, 2, 3};
  file.mesh.channel_names = {"a"};
  file.mesh.channel_values = {0, 1, 2, 3, 4};
  file.second_order.cells = {0};
  file.second_order.first_nodes = {0};
  for (const auto& [a, b] : mid_edges(CellKind::kTet)) {
    file.second_order.nodes.push_back(static_cast<std::uint32_t>(file.mesh.vertex_count()));
    file.mesh.positions.push_back(0.5 * (file.mesh.positions[a] + file.mesh.positions[b]) + Vec3(0.1, 0, 0));
    file.mesh.channel_values.push_back(static_cast<float>(10 * a + b));
  }
  return file;
}

TEST(MidNodes, OfSecondOrderCellsBecomeThoseOfTheirEdges) {
  MeshFile file = two_tetrahedra();
  leave_out_unused_vertices({}, TextScanner(""), file);
  EXPECT_EQ(5u, file.mesh.vertex_count());
  EXPECT_TRUE(file.second_order.cells.empty());
  EXPECT_TRUE(file.warnings.empty()) << "nodes between corners are no vertices that nobody uses";
  const MidNodes& nodes = file.mesh.mid_nodes;
  using Edge = std::array<std::uint32_t, 2>;
  EXPECT_THAT(nodes.edges, ElementsAre(Edge{0, 1}, Edge{0, 2}, Edge{0, 3}, Edge{1, 2}, Edge{1, 3}, Edge{2, 3}));
  EXPECT_THAT(nodes.values, ElementsAre(1, 20, 3, 12, 13, 23));
  EXPECT_EQ(Vec3(3.1, 0, 0), nodes.positions[0]);
  file.mesh.as_meshed = true;
  EXPECT_NO_THROW(validate(file.mesh));
}

/// The second cell has another node on the edge 1-2, so far from the first one's.
MeshFile two_nodes_on_an_edge(double apart) {
  MeshFile file = two_tetrahedra();
  file.second_order.cells = {0, 1};
  file.second_order.first_nodes = {0, 6};
  const auto node = static_cast<std::uint32_t>(file.mesh.vertex_count());
  file.mesh.positions.push_back(Vec3(3.1, 3, apart));
  file.mesh.channel_values.push_back(12.5);
  for (std::size_t e = 0; e < 6; ++e) file.second_order.nodes.push_back(e == 2 ? node : kNone);
  return file;
}

TEST(MidNodes, OfOneEdgeInTwoPlacesAreTold) {
  MeshFile file = two_nodes_on_an_edge(0.5);
  take_mid_nodes(file);
  EXPECT_EQ(6u, file.mesh.mid_nodes.edges.size());
  EXPECT_EQ(Vec3(3.1, 3, 0), file.mesh.mid_nodes.positions[3]);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 edges, faces or cells have nodes in their middle that disagree"),
                                         HasSubstr("have several nodes in their middle, up to 0.5 apart")));
}

// Cells whose nodes are listed in another order than the format's would fold. One stray node is no such order.
TEST(MidNodes, OfManyEdgesFarApartAreLeftOut) {
  MeshFile stray = two_nodes_on_an_edge(3);
  take_mid_nodes(stray);
  EXPECT_EQ(6u, stray.mesh.mid_nodes.edges.size());
  MeshFile file;
  file.mesh = oracle::box_mesh(2, 1, 1);
  const std::size_t corners = file.mesh.vertex_count();
  for (std::uint32_t cell = 0; cell < 2; ++cell) {
    file.second_order.cells.push_back(cell);
    file.second_order.first_nodes.push_back(file.second_order.nodes.size());
    const auto edges = mid_edges(CellKind::kHex);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      // The second cell lists the node of the edge after next.
      const auto& [a, b] = edges[cell == 0 ? e : (e + 2) % edges.size()];
      const auto& vertices = file.mesh.cell_vertices;
      file.second_order.nodes.push_back(static_cast<std::uint32_t>(file.mesh.vertex_count()));
      file.mesh.positions.push_back(
          (file.mesh.positions[vertices[8 * cell + a]] + file.mesh.positions[vertices[8 * cell + b]]) / 2);
    }
  }
  take_mid_nodes(file);
  EXPECT_TRUE(file.mesh.mid_nodes.empty());
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("places: they aren't in the format's order")));
  EXPECT_EQ(corners, 12u);
}

TEST(MidNodes, AreRenumberedWithTheirVertices) {
  MidNodeList list(1);
  const float value = 7;
  list.add_edge({5, 2}, {Vec3(1, 2, 3), {&value, 1}, 77});
  list.add_edge({2, 4}, {Vec3(4, 5, 6), {&value, 1}, 66});
  const MidNodeList::Result before = list.finish();
  EXPECT_THAT(before.numbers, ElementsAre(66, 77));
  MidNodeList renumbered(1);
  renumbered.add(before.nodes, before.numbers, std::vector<std::uint32_t>{kNone, kNone, 9, kNone, kNone, 1}, {});
  const MidNodeList::Result after = renumbered.finish();
  EXPECT_THAT(after.nodes.edges, ElementsAre(std::array<std::uint32_t, 2>{1, 9}));
  EXPECT_EQ(Vec3(1, 2, 3), after.nodes.positions[0]);
  EXPECT_THAT(after.numbers, ElementsAre(77));
}

TEST(MidNodes, OfEdgesAndFacesThatCollapseAreLeftOut) {
  MidNodeList list(0);
  list.add_edge({0, 1}, {Vec3(1, 0, 0), {}});
  list.add_edge({2, 3}, {Vec3(2, 0, 0), {}});
  list.add_face({0, 1, 2, 3}, {Vec3(3, 0, 0), {}});
  MidNodeList renumbered(0);
  renumbered.add(list.finish().nodes, {}, std::vector<std::uint32_t>{0, 0, 1, 2}, {});
  const MidNodes after = renumbered.finish().nodes;
  EXPECT_THAT(after.edges, ElementsAre(std::array<std::uint32_t, 2>{1, 2}));
  EXPECT_TRUE(after.faces.empty());
  EXPECT_THAT(after.positions, ElementsAre(Vec3(2, 0, 0)));
}

TEST(MidNodes, HaveTheMeansOfTheirCornersInAddedChannels) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  mesh.as_meshed = true;
  oracle::add_random_mid_nodes(0, true, 1, mesh);
  NamedChannel channel{"a", {}};
  for (std::size_t v = 0; v < 8; ++v) channel.values.push_back(static_cast<float>(v));
  append_channels({&channel, 1}, mesh);
  ASSERT_EQ(19u, mesh.mid_nodes.values.size());
  const MidNodeCorners corners(mesh);
  for (std::size_t n = 0; n < 19; ++n) {
    float sum = 0;
    for (const std::uint32_t v : corners[n]) sum += static_cast<float>(v);
    EXPECT_FLOAT_EQ(sum / static_cast<float>(corners[n].size()), mesh.mid_nodes.values[n]);
  }
  EXPECT_NO_THROW(validate(mesh));
}

TEST(MidNodes, ThatCantBeAreRefused) {
  const auto refuse = [](auto change, ErrorCode code, const std::string& text) {
    ControlMesh mesh = oracle::box_mesh(2, 1, 1);
    mesh.as_meshed = true;
    oracle::add_random_mid_nodes(0, true, 1, mesh);
    change(mesh);
    try {
      validate(mesh);
      FAIL() << "no error: " << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code);
      EXPECT_THAT(error.what(), HasSubstr(text));
    }
  };
  refuse(
      [](ControlMesh& mesh) {
        mesh.sharp_edges = {{0, 1}};
      },
      ErrorCode::kMeshBadSharpFeature, "sharp_edges can't go with as_meshed");
  refuse([](ControlMesh& mesh) { mesh.interpolating = true; }, ErrorCode::kMeshBadSharpFeature, "interpolating can't");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.edges[3] = {0, 11}; }, ErrorCode::kMeshBadMidNode, "mid-node 3");
  refuse([](ControlMesh& mesh) { std::swap(mesh.mid_nodes.edges[0], mesh.mid_nodes.edges[1]); },
         ErrorCode::kMeshBadMidNode, "again or too late: mid-node 1");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.cells = {1, 1}; }, ErrorCode::kMeshBadMidNode, "mid-node 1");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.faces[1][3] = 4'000'000'000; }, ErrorCode::kMeshBadMidNode,
         "mid-node 1");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.cells[1] = 7; }, ErrorCode::kMeshBadMidNode, "mid-node 1");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.positions.pop_back(); }, ErrorCode::kMeshArrayMismatch,
         "node_positions_mm");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.values.push_back(0); }, ErrorCode::kMeshArrayMismatch, "node_values");
  refuse([](ControlMesh& mesh) { mesh.mid_nodes.positions[2].x() = std::nan(""); }, ErrorCode::kMeshNonFinite,
         "position at mid-node 2");
}

}  // namespace
}  // namespace ccslice
