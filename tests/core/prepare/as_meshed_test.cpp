// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Solids that are taken as meshed, against finite elements of the textbooks.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/inversion/point_inverter.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/validate.h"
#include "core/mesh_authoring/grade.h"
#include "core/prepare/deviation.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/finite_elements.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

ControlMesh as_meshed(ControlMesh mesh) {
  mesh.as_meshed = true;
  mesh.sharp_edges.clear();
  mesh.sharp_vertices.clear();
  validate(mesh);
  return mesh;
}

double volume_mm3(const oracle::FiniteElements& elements) {
  double volume = 0;
  for (std::uint32_t cell = 0; cell < elements.cell_count(); ++cell) volume += elements.volume_mm3(cell);
  return volume;
}

/// Places of finite elements are found in the solid, in the same cell, with the same channels.
void expect_elements(const std::string& name, const ControlMesh& mesh, int places_of_cell, std::uint32_t seed) {
  SCOPED_TRACE(name);
  const auto solid = prepare_solid(mesh);
  ASSERT_EQ(0u, solid->summary().folding_cells);
  const oracle::FiniteElements elements(mesh);
  EXPECT_NEAR(1, solid->summary().deviation.limit_volume_mm3 / volume_mm3(elements), 1e-12);
  PointInverter inverter(*solid);
  std::mt19937 random(seed);
  std::vector<double> channels(mesh.channel_count());
  double worst = 0;
  for (std::uint32_t cell = 0; cell < elements.cell_count(); ++cell) {
    for (int i = 0; i < places_of_cell; ++i) {
      const std::vector<double> expected = elements.value(cell, elements.random_place(cell, random));
      const auto found = inverter.invert(Vec3::Map(expected.data()));
      ASSERT_TRUE(found) << "cell " << cell;
      const Vec3 position = inverter.evaluator().geo_and_mat(found->at, channels);
      EXPECT_LT((position - Vec3::Map(expected.data())).norm(), 1e-6);
      if (solid->control_cell(found->at.cell) != cell) continue;  // On a face that both share.
      // What inversion leaves in space is taken back along the cell's own slopes.
      const auto at = elements.find(cell, position);
      ASSERT_TRUE(at);
      const std::vector<double> there = elements.value(cell, *at);
      for (std::size_t c = 0; c < channels.size(); ++c) worst = std::max(worst, std::abs(channels[c] - there[3 + c]));
    }
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(AsMeshed, LinearCellsAreFiniteElements) {
  std::uint32_t seed = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) expect_elements(name, as_meshed(mesh), 8, ++seed);
}

TEST(AsMeshed, CellsOfSecondOrderWithNodesOnEdgesAreFiniteElements) {
  std::uint32_t seed = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    ControlMesh curved = as_meshed(mesh);
    oracle::add_random_mid_nodes(0.05, false, ++seed, curved);
    expect_elements(name, curved, 4, seed);
  }
}

TEST(AsMeshed, CellsOfSecondOrderWithNodesOnFacesAreFiniteElements) {
  std::uint32_t seed = 100;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    ControlMesh curved = as_meshed(mesh);
    oracle::add_random_mid_nodes(0.02, true, ++seed, curved);
    expect_elements(name, curved, 4, seed);
  }
}

TEST(AsMeshed, EveryHexahedronIsOneCellAndNothingMoves) {
  const ControlMesh mesh = as_meshed(oracle::box_mesh(3, 2, 2));
  const auto solid = prepare_solid(mesh);
  const SolidSummary& summary = solid->summary();
  EXPECT_TRUE(solid->as_meshed());
  EXPECT_EQ(12u, summary.limit_cells);
  EXPECT_EQ(12u, summary.regular_cells);
  EXPECT_EQ(0u, summary.extraordinary_edges + summary.extraordinary_vertices + summary.irregular_boundary_edges);
  EXPECT_NEAR(12000, summary.deviation.limit_volume_mm3, 1e-8);
  EXPECT_EQ(summary.deviation.limit_volume_mm3, summary.deviation.control_volume_mm3);
  EXPECT_LT(summary.deviation.farthest.distance_mm(), 1e-12);
  EXPECT_TRUE(summary.deviation.as_meshed);
  EXPECT_EQ(Vec3(30, 20, 20), summary.bounding_box.sizes());
}

TEST(AsMeshed, TetrahedraAreFourCellsAndWedgesSix) {
  const auto tetrahedra = prepare_solid(as_meshed(oracle::kuhn_box(2)));
  EXPECT_EQ(4 * tetrahedra->summary().control_cells, tetrahedra->summary().limit_cells);
  for (const LimitCellId cell : tetrahedra->cells()) EXPECT_EQ(cell / 4, tetrahedra->control_cell(cell));
  const auto mixed = prepare_solid(as_meshed(oracle::tiny_mesh("wedges_round_edge_5")));
  EXPECT_EQ(6 * mixed->summary().control_cells, mixed->summary().limit_cells);
}

TEST(AsMeshed, PreparesAlikeOnAnyNumberOfThreads) {
  ControlMesh mesh = as_meshed(oracle::kuhn_box(5));
  oracle::add_random_mid_nodes(0.03, false, 7, mesh);
  PrepareOptions options;
  const auto one = prepare_solid(mesh, options);
  options.threads = 3;
  const auto three = prepare_solid(mesh, options);
  LimitEvaluator first(*one), other(*three);
  for (const LimitCellId cell : one->cells()) {
    EXPECT_EQ(first.geo({cell, Vec3(0.3, 0.6, 0.9)}), other.geo({cell, Vec3(0.3, 0.6, 0.9)}));
  }
}

/// An eighth of a ring, as one cell: with nodes on its arcs it has the ring's volume but for 8e-4 of it, without 10 %
/// less.
TEST(AsMeshed, CurvedCellsAreRound) {
  constexpr double kAngle = std::numbers::pi / 4, kInner = 10, kOuter = 20, kHeight = 5;
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  const auto at = [](double radius, double angle, double z) {
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), z);
  };
  for (Vec3& p : mesh.positions) p = at(p.x() == 0 ? kInner : kOuter, p.y() == 0 ? 0 : kAngle, p.z() / 10 * kHeight);
  mesh = as_meshed(mesh);
  const double ring_mm3 = kAngle / 2 * (kOuter * kOuter - kInner * kInner) * kHeight;
  EXPECT_NEAR(0.9, prepare_solid(mesh)->summary().deviation.limit_volume_mm3 / ring_mm3, 1e-3);
  oracle::add_random_mid_nodes(0, false, 1, mesh);
  for (std::size_t e = 0; e < mesh.mid_nodes.edges.size(); ++e) {
    const auto [a, b] = mesh.mid_nodes.edges[e];
    const Vec3 &first = mesh.positions[a], &last = mesh.positions[b];
    const double radius = first.head<2>().norm();
    if (std::abs(last.head<2>().norm() - radius) > 1e-9 || first.z() != last.z()) continue;
    mesh.mid_nodes.positions[e] = at(radius, kAngle / 2, first.z());
  }
  EXPECT_NEAR(1, prepare_solid(mesh)->summary().deviation.limit_volume_mm3 / ring_mm3, 1e-3);
}

TEST(AsMeshed, ALinearGradeIsLinearInCurvedCells) {
  ControlMesh mesh = as_meshed(oracle::tiny_mesh("wedges_round_edge_5"));
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  oracle::add_random_mid_nodes(0.1, false, 3, mesh);
  apply_grade(parse_grade("g=x:0..1"), mesh);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  const auto grade_at = [&](const Vec3& uvw, LimitCellId cell) {
    std::vector<double> channels(1);
    const Vec3 at = evaluator.geo_and_mat({cell, uvw}, channels);
    return std::pair(at.x(), channels[0]);
  };
  const auto [x0, g0] = grade_at(Vec3(0.1, 0.2, 0.3), LimitCellId{0});
  const auto [x1, g1] = grade_at(Vec3(0.9, 0.8, 0.7), LimitCellId{0});
  for (const LimitCellId cell : solid->cells()) {
    const auto [x, g] = grade_at(Vec3(0.25, 0.6, 0.45), cell);
    EXPECT_NEAR(g0 + (x - x0) * (g1 - g0) / (x1 - x0), g, 1e-6);
  }
}

TEST(AsMeshed, NodesThatFoldACellAreFound) {
  ControlMesh mesh = as_meshed(oracle::box_mesh(2, 1, 1));
  oracle::add_random_mid_nodes(0, false, 1, mesh);
  EXPECT_EQ(0u, prepare_solid(mesh)->summary().folding_cells);
  mesh.mid_nodes.positions[0] += Vec3(9, 9, 9);  // Of an edge of 10 mm.
  const auto solid = prepare_solid(mesh);
  EXPECT_GT(solid->summary().folding_cells, 0u);
  EXPECT_FALSE(solid->summary().folds.empty());
}

/// A channel that jumps has no one value in the middle of an edge: the means of its ends are taken there.
TEST(AsMeshed, NodesOfAnInterfaceFollowTheirRegionsCorners) {
  ControlMesh mesh = as_meshed(oracle::box_mesh(2, 1, 1));
  mesh.channel_names = {"a", "b"};
  mesh.channel_values.assign(2 * mesh.vertex_count(), 0);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) mesh.channel_values[2 * v + 1] = 5;
  oracle::add_random_mid_nodes(0, false, 1, mesh);
  for (std::size_t n = 0; n < mesh.mid_nodes.edges.size(); ++n) {
    mesh.mid_nodes.values[2 * n] = 7, mesh.mid_nodes.values[2 * n + 1] = 6;
  }
  mesh.cell_region_names = {"left", "right"};
  mesh.cell_regions = {0, 1};
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.positions[v].x() != 10) continue;
    mesh.region_value_vertices.push_back(v);
    mesh.region_value_regions.push_back(1);
    mesh.region_values.insert(mesh.region_values.end(), {100, 5});
  }
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  const auto values_at = [&](std::uint32_t cell, const Vec3& uvw) {
    std::vector<double> values(2);
    evaluator.mat({LimitCellId{cell}, uvw}, values);
    return values;
  };
  EXPECT_NEAR(7, values_at(0, Vec3(1, 0.5, 0))[0], 1e-12);    // On the interface, from the left: the node's value.
  EXPECT_NEAR(100, values_at(1, Vec3(0, 0.5, 0))[0], 1e-12);  // From the right: that of the region's corners.
  EXPECT_NEAR(50, values_at(1, Vec3(0.5, 0, 0))[0], 1e-12);
  EXPECT_NEAR(6, values_at(1, Vec3(0, 0.5, 0))[1], 1e-12);  // A channel that doesn't jump keeps the node's.
}

}  // namespace
}  // namespace ccslice
