// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/rounded_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/mesh/validate.h"
#include "core/mesh_authoring/sharpen.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

RoundedEdges rounded_edges_of(ControlMesh mesh) {
  validate(mesh);
  return find_rounded_edges(
      surface_rings(mesh, make_cell_complex(mesh)), [&](std::uint32_t vertex) { return mesh.positions[vertex]; },
      mesh.sharp_edges);
}

TEST(RoundedEdges, AreThoseOfABoxThatAreNotSharp) {
  ControlMesh box = oracle::box_mesh(3, 2, 2);
  const RoundedEdges all = rounded_edges_of(box);
  EXPECT_EQ(all.count, 28u);
  EXPECT_NEAR(all.turn_deg, 90, 1e-9);
  EXPECT_TRUE(all.place.x() == 0 || all.place.y() == 0 || all.place.z() == 0);
  const std::vector<SharpEdge> edges = find_sharp_edges(box, 90).convex;
  for (std::size_t i = 1; i < edges.size(); ++i) box.sharp_edges.push_back({edges[i][1], edges[i][0]});
  const RoundedEdges one = rounded_edges_of(box);
  EXPECT_EQ(one.count, 1u);
  EXPECT_EQ(one.place, (box.positions[edges[0][0]] + box.positions[edges[0][1]]) / 2);
}

TEST(RoundedEdges, AreReentrantOnesToo) {
  ControlMesh notched = oracle::box_mesh(2, 2, 2, 10, [](int i, int j, int k) { return i + j + k < 3; });
  validate(notched);
  add_sharp_features({find_sharp_edges(notched, 40).convex, {}}, notched);
  EXPECT_EQ(rounded_edges_of(notched).count, 3u);
}

TEST(RoundedEdges, AreDescribed) {
  EXPECT_EQ(
      describe(RoundedEdges{72, Vec3(1, 2.5, -3), 90}),
      "72 edges where the mesh turns by 75 degrees or more aren't sharp, and the limit bulges there; the most, by "
      "90 degrees, near (1, 2.5, -3) mm");
}

/// A cube within a box of other cells, which has all sharp edges. Where a region reaches the outside its rim is sharp.
TEST(RoundedEdges, AreThoseOfInterfaces) {
  ControlMesh box = oracle::box_mesh(3, 3, 3);
  validate(box);
  add_sharp_features({find_sharp_edges(box, 40).convex, {}}, box);
  EXPECT_EQ(rounded_edges_of(box).count, 0u);
  box.cell_region_names = {"core", "shell"};
  box.cell_regions.assign(27, 1);
  box.cell_regions[13] = 0;
  const RoundedEdges inside = rounded_edges_of(box);
  EXPECT_EQ(inside.count, 12u);
  EXPECT_NEAR(inside.turn_deg, 90, 1e-9);
  box.cell_regions.assign(27, 1);
  box.cell_regions[0] = 0;
  EXPECT_EQ(rounded_edges_of(box).count, 3u) << "those of the corner cell inside";
}

/// Prisms of n sides turn by 360/n degrees all round: of five sides on they may be meant to be round.
TEST(RoundedEdges, AreNotThoseOfWhatGoesRound) {
  for (const int sides : {4, 5, 8}) {
    ControlMesh prism;
    for (const double z : {0.0, 1.0}) {
      prism.positions.emplace_back(0, 0, z);
      for (int i = 0; i < sides; ++i) {
        const double angle = 2 * EIGEN_PI * i / sides;
        prism.positions.emplace_back(std::cos(angle), std::sin(angle), z);
      }
    }
    const auto top = static_cast<std::uint32_t>(sides + 1);
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i) {
      const std::uint32_t a = 1 + i, b = 1 + (i + 1) % static_cast<std::uint32_t>(sides);
      prism.cell_kinds.push_back(CellKind::kWedge);
      prism.cell_vertices.insert(prism.cell_vertices.end(), {0, a, b, top, top + a, top + b});
      prism.sharp_edges.push_back({a, b});
      prism.sharp_edges.push_back({top + a, top + b});
    }
    EXPECT_EQ(rounded_edges_of(prism).count, sides < 5 ? 4u : 0u) << sides;
  }
}

}  // namespace
}  // namespace ccslice
