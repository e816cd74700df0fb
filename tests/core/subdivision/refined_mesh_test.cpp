// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refined_mesh.h"

#include <gtest/gtest.h>

#include <string>

#include "core/mesh/validate.h"
#include "tests/support/brute_force.h"
#include "tests/support/finite_elements.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

ControlMesh valid(ControlMesh mesh) {
  mesh.allow_folds = true;
  validate(mesh);
  return mesh;
}

TEST(RefinedMesh, HasTheSameLimit) {
  for (const char* name : {"box_2", "hex_wedge_tet", "cube_of_tets", "sharp_two_at_corner", "edge_valence_5_inside"}) {
    const ControlMesh mesh = valid(oracle::tiny_mesh(name)), fine = refine_mesh(mesh, 2);
    EXPECT_EQ(fine.cell_count(), refined_cell_count(mesh, 2)) << name;
    const ControlMesh coarse_limit = mesh_of_limit_points(mesh), fine_limit = mesh_of_limit_points(fine);
    // Vertices come first among their children.
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      EXPECT_LT((coarse_limit.positions[v] - fine_limit.positions[v]).norm(), 1e-12) << name << " vertex " << v;
    }
  }
}

TEST(RefinedMesh, OfLimitPointsHasThePointsAndChannelsOfBruteForce) {
  const ControlMesh mesh = valid(oracle::tiny_mesh("hex_wedge_tet")), limit = mesh_of_limit_points(mesh);
  const oracle::BruteMesh brute = oracle::to_brute_mesh(mesh);
  const oracle::BruteTopology topology = oracle::build_topology(brute.cells, brute.vertex_count());
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    const oracle::PointValue expected = oracle::limit_point(brute, topology, v);
    EXPECT_LT((limit.positions[v] - expected.head<3>()).norm(), 1e-12) << v;
    for (std::size_t c = 0; c < mesh.channel_count(); ++c) {
      EXPECT_FLOAT_EQ(limit.channel_values[v * mesh.channel_count() + c],
                      static_cast<float>(expected[static_cast<Eigen::Index>(3 + c)]))
          << v;
    }
  }
  EXPECT_EQ(limit.cell_vertices, mesh.cell_vertices);
}

/// Limit points are no control points, nor are children the vertices that a fit was to meet.
TEST(RefinedMesh, ForgetsWhatAFitMissed) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  mesh.interpolating = true;
  mesh.missed_vertices = {{0, Vec3(-1, -1, -1)}};
  EXPECT_TRUE(refine_mesh(mesh, 1).missed_vertices.empty());
  EXPECT_TRUE(mesh_of_limit_points(mesh).missed_vertices.empty());
}

double volume_mm3(const ControlMesh& meshed) {
  const oracle::FiniteElements elements(meshed);
  double volume = 0;
  for (std::uint32_t c = 0; c < elements.cell_count(); ++c) volume += elements.volume_mm3(c);
  return volume;
}

TEST(RefinedMesh, KeepsTheSolidOfAMeshAsMeshed) {
  ControlMesh cube = oracle::box_mesh(1, 1, 1, 10);
  cube.as_meshed = true;
  for (const int times : {0, 1}) {
    EXPECT_NEAR(volume_mm3(mesh_of_limit_points(refine_mesh(cube, times))), 1000, 1e-9) << times;
  }
  for (const char* name : {"hex_wedge_tet", "cube_of_tets", "edge_valence_5_inside"}) {
    ControlMesh mesh = oracle::tiny_mesh(name);
    mesh.as_meshed = true;
    mesh = valid(mesh);
    const ControlMesh same = mesh_of_limit_points(mesh), fine = mesh_of_limit_points(refine_mesh(mesh, 2));
    EXPECT_EQ(same.positions, mesh.positions) << name;
    EXPECT_EQ(same.channel_values, mesh.channel_values) << name;
    EXPECT_NEAR(volume_mm3(fine), volume_mm3(mesh), 1e-9 * volume_mm3(mesh)) << name;
  }
}

/// Away from a sharp, straight boundary nothing moves: children are where their control cell is.
TEST(RefinedMesh, KnowsTheControlCellsOfItsCells) {
  ControlMesh mesh = oracle::box_mesh(3, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const ControlMesh fine = refine_mesh(mesh, 2);
  const std::vector<std::uint32_t> cells = control_cells_of(mesh, 2);
  ASSERT_EQ(cells.size(), fine.cell_count());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    Vec3 middle = Vec3::Zero(), control_middle = Vec3::Zero();
    for (std::size_t i = 0; i < 8; ++i) {
      middle += fine.positions[fine.cell_vertices[8 * c + i]] / 8;
      control_middle += mesh.positions[mesh.cell_vertices[8 * cells[c] + i]] / 8;
    }
    EXPECT_LT((middle - control_middle).cwiseAbs().maxCoeff(), 5) << c;
  }
  EXPECT_EQ(control_cells_of(mesh, 0), (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(refined_cell_count(valid(oracle::tiny_mesh("hex_wedge_tet")), 1),
            refined_cell_count(valid(oracle::tiny_mesh("hex_wedge_tet")), 2) / 8);
}

TEST(RefinedMesh, StaysAsItIsWithoutRefinement) {
  const ControlMesh mesh = oracle::tiny_mesh("single_wedge");
  const ControlMesh same = refine_mesh(mesh, 0);
  EXPECT_EQ(same.cell_kinds, mesh.cell_kinds);
  EXPECT_EQ(same.cell_vertices, mesh.cell_vertices);
  EXPECT_EQ(refined_cell_count(mesh, 0), 1u);
}

}  // namespace
}  // namespace ccslice
