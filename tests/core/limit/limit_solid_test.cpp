// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_data.h"
#include "core/limit/support.h"
#include "core/mesh/cell_kind.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(LimitSolid, RefinesOnlyCellsThatNeedIt) {
  // A smooth box of four cells a side has no cell with two lines or two corners; one of three has.
  EXPECT_EQ(prepare_solid(oracle::box_mesh(4, 4, 4))->cell_count(), 64u);
  EXPECT_EQ(prepare_solid(oracle::box_mesh(1, 1, 1))->cell_count(), 8u);
  ControlMesh mixed = oracle::box_mesh(9, 4, 4);
  // One sharp edge alone: two chain ends in one cell.
  oracle::sharpen(mixed, [](const Vec3& a, const Vec3& b) { return a == Vec3(40, 20, 0) && b == Vec3(50, 20, 0); });
  const auto solid = prepare_solid(mixed);
  EXPECT_GT(solid->cell_count(), 144u);
  EXPECT_LT(solid->cell_count(), 144u + 7 * 10);
}

// Sheared boxes hold all of their cells, and little else where cells are straight.
TEST(LimitSolid, KnowsWhichPointsACellMayHold) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    for (const LimitCellId cell : solid->cells()) {
      const CellMap map = solid->data().cell_maps[cell];
      for (int n = 0; n < 40; ++n) {
        Vec3 uvw(share(random), share(random), share(random));
        if (n % 2 == 0) uvw[n / 2 % 3] = n / 6 % 2;  // On a face.
        ASSERT_TRUE(map.may_hold(map(evaluator.geo({cell, uvw})), 0)) << name << " " << cell << " " << uvw.transpose();
      }
    }
  }
  ControlMesh sheared = oracle::box_mesh(4, 4, 4);
  for (Vec3& p : sheared.positions) p.x() += 3 * p.z();
  const auto solid = prepare_solid(sheared);
  for (const LimitCellId cell : solid->cells()) {
    if (solid->cell_class(cell) != CellClass::kRegular) continue;
    const CellMap map = solid->data().cell_maps[cell];
    const Vec3 beside = map.middle + Vec3(12, 0, 0);  // In the cell's box.
    EXPECT_TRUE(solid->data().cell_boxes.box(cell).contains(beside));
    EXPECT_FALSE(map.may_hold(map(beside), 0.1));
    EXPECT_TRUE(map.may_hold(map(beside), 10));
  }
}

TEST(LimitSolid, NumbersCellsInTheOrderOfTheirControlCells) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    ControlCellId before;
    for (const LimitCellId c : solid->cells()) {
      EXPECT_LE(before, solid->control_cell(c)) << name;
      before = solid->control_cell(c);
    }
    EXPECT_EQ(before, mesh.cell_count() - 1) << name;
  }
}

// Twelve cubes in a row, some of which are refined.
TEST(LimitSolid, CellsTouchIfTheirControlCellsShareAVertex) {
  const auto solid = prepare_solid(oracle::box_mesh(12, 1, 1));
  for (const LimitCellId a : solid->cells()) {
    for (const LimitCellId b : solid->cells()) {
      const auto in_row = [&](LimitCellId cell) { return static_cast<int>(solid->control_cell(cell)); };
      EXPECT_EQ(solid->touch(a, b), std::abs(in_row(a) - in_row(b)) <= 1);
    }
  }
}

TEST(LimitSolid, SummarizesWhatItHolds) {
  ControlMesh fan = oracle::fan_mesh(5, 2, 3);
  oracle::add_random_channels(fan, 2, 5);
  const auto solid = prepare_solid(fan);
  const SolidSummary& summary = solid->summary();
  EXPECT_EQ(summary.control_cells, 5u * 4 * 3);
  EXPECT_EQ(summary.extraordinary_edges, 3u);
  EXPECT_EQ(summary.extraordinary_vertices, 0u);
  EXPECT_EQ(summary.limit_cells, solid->cell_count());
  EXPECT_EQ(summary.regular_cells + summary.line_cells + summary.vertex_cells, summary.limit_cells);
  EXPECT_EQ(summary.folding_cells, 0u);
  ASSERT_EQ(summary.channels.size(), 2u);
  EXPECT_LT(summary.channels[0].min, summary.channels[0].max);
  EXPECT_GT(summary.memory_bytes, 10'000u);
}

// In the plane of the moved points the limit's derivative along x is a quadratic that touches zero, at a third of a
// cell.
TEST(LimitSolid, CountsCellsOfWhichItCannotBeToldWhetherTheyFold) {
  ControlMesh mesh = oracle::box_mesh(7, 3, 4);
  for (Vec3& p : mesh.positions) {
    if (p.x() == 40 && p.z() == 20) p.x() = 17.5;
  }
  mesh.allow_folds = true;
  const auto solid = prepare_solid(mesh);
  EXPECT_GE(solid->summary().undecided_cells, 2u);
  EXPECT_EQ(solid->summary().folding_cells, 0u);
  EXPECT_TRUE(solid->summary().folds.empty());
}

TEST(LimitSolid, CountsExtraordinaryVerticesOfTheControlMesh) {
  std::size_t meshes = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    meshes += prepare_solid(mesh)->summary().extraordinary_vertices > 0;
  }
  EXPECT_GE(meshes, 2u);
}

TEST(LimitSolid, BoxOfASharpBoxIsTheBox) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2, 5);
  oracle::sharpen_by_cells(mesh, 1);
  const Box3 box = prepare_solid(mesh)->summary().bounding_box;
  EXPECT_LT(box.min().norm(), 1e-12);
  EXPECT_LT((box.max() - Vec3::Constant(10)).norm(), 1e-12);
}

TEST(LimitSolid, BoundingBoxHoldsTheLimitAndIsTouchedByIt) {
  std::mt19937 random(11);
  for (const std::string name : {"single_hex", "single_tet", "hollow_cube"}) {
    const auto found = std::find_if(oracle::tiny_meshes().begin(), oracle::tiny_meshes().end(),
                                    [&](const auto& tiny) { return tiny.name == name; });
    if (found == oracle::tiny_meshes().end()) continue;
    const auto solid = prepare_solid(found->mesh);
    Placement turn = Placement::Identity();
    turn.rotate(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())).translate(Vec3(5, -3, 2));
    const Box3 box = bounding_box(*solid, turn);
    Box3 sampled;
    LimitEvaluator evaluator(*solid);
    for (const LimitCellId c : solid->cells()) {
      for (int i = 0; i < 17 * 17 * 17; ++i) {
        const Vec3 uvw = Vec3(i % 17, i / 17 % 17, i / 289) / 16;
        if (((uvw.array() != 0) && (uvw.array() != 1)).all()) continue;
        sampled.extend(turn * evaluator.geo({c, uvw}));
      }
    }
    const double diagonal = box.diagonal().norm();
    EXPECT_TRUE((sampled.min().array() >= box.min().array() - 1e-9 * diagonal).all()) << name;
    EXPECT_TRUE((sampled.max().array() <= box.max().array() + 1e-9 * diagonal).all()) << name;
    EXPECT_LT((sampled.diagonal() - box.diagonal()).norm(), 0.01 * diagonal) << name;
  }
}

TEST(LimitSolid, DetectsAFoldAndSaysWhere) {
  ControlMesh mesh = oracle::folding_box_mesh();
  EXPECT_THROW(prepare_solid(mesh), Error);
  mesh.allow_folds = true;
  const auto solid = prepare_solid(mesh);
  const SolidSummary& summary = solid->summary();
  LimitEvaluator evaluator(*solid);
  EXPECT_FALSE(summary.inverted_control_cells.empty());
  EXPECT_GT(summary.folding_cells, 0u);
  ASSERT_FALSE(summary.folds.empty());
  for (const FoldPlace& fold : summary.folds) {
    EXPECT_LE(fold.determinant, 0);
    EXPECT_TRUE(summary.bounding_box.contains(fold.position));
    EXPECT_EQ(solid->control_cell(fold.cell), fold.control_cell);
    double least = 1;
    for (int i = 0; i < 9 * 9 * 9; ++i) {
      const Vec3 uvw = Vec3(i % 9, i / 9 % 9, i / 81) / 8;
      least = std::min(least, evaluator.sample({fold.cell, uvw}).jacobian.determinant());
    }
    EXPECT_LE(least, 0) << "cell " << fold.cell << " doesn't fold";
  }
}

// Three boxes round an edge along each axis: those of the middle box are on the boundary, the reentrant one too.
TEST(LimitSolid, HasEdgesOnTheBoundary) {
  for (int along = 0; along < 3; ++along) {
    const auto solid =
        prepare_solid(oracle::box_mesh(along == 0 ? 1 : 2, along == 1 ? 1 : 2, along == 2 ? 1 : 2, 10,
                                       [](int x, int y, int z) { return (x == 0) + (y == 0) + (z == 0) >= 2; }));
    LimitEvaluator evaluator(*solid);
    std::size_t reentrant = 0;
    for (const LimitCellId cell : solid->cells()) {
      for (std::size_t e = 0; e < cell_tables::kHexEdges.size(); ++e) {
        unsigned sides = 0;  // That hold the edge.
        Vec3 middle = Vec3::Constant(0.5);
        for (int axis = 0; axis < 3; ++axis) {
          const unsigned from = cell_tables::kHexEdges[e][0] >> axis & 1u;
          if (from != (cell_tables::kHexEdges[e][1] >> axis & 1u)) continue;
          sides |= 1u << (2 * static_cast<unsigned>(axis) + from);
          middle[axis] = from;
        }
        const bool has_face = (solid->boundary_sides(cell) & sides) != 0;
        const bool on_boundary = (solid->boundary_edges(cell) >> e & 1) != 0;
        if (has_face) {
          EXPECT_TRUE(on_boundary) << "cell " << cell << ", edge " << e;
          continue;
        }
        if (!on_boundary) continue;
        ++reentrant;
        Vec3 off = evaluator.geo({cell, middle}) - Vec3::Constant(10);
        off[along] = 0;
        EXPECT_LT(off.norm(), 3) << "cell " << cell << ", edge " << e;
      }
    }
    EXPECT_EQ(reentrant, 2u) << "along " << along;  // Of two of the middle box's eight cells.
  }
}

// An interface is none, but where it ends.
TEST(LimitSolid, HasNoEdgesOfInterfacesOnTheBoundary) {
  const auto solid = prepare_solid(
      oracle::with_regions(oracle::box_mesh(4, 4, 4), 2, [](const Vec3& p) { return p.x() < 20 ? 0 : 1; }));
  std::size_t interfaces = 0;
  for (const LimitCellId cell : solid->cells()) {
    if (solid->interface_sides(cell) == 0 || solid->boundary_sides(cell) != 0) continue;
    ++interfaces;
    EXPECT_EQ(solid->boundary_edges(cell), 0) << "cell " << cell;
  }
  EXPECT_GT(interfaces, 0u);
}

// Interfaces have a face for the region of the lower number alone, but both regions end there.
TEST(LimitSolid, HasInterfacesOnBothSides) {
  const auto solid = prepare_solid(
      oracle::with_regions(oracle::box_mesh(2, 2, 2), 2, [](const Vec3& p) { return p.x() < 10 ? 0 : 1; }));
  LimitEvaluator evaluator(*solid);
  std::array<std::size_t, 2> interfaces{};
  for (const LimitCellId cell : solid->cells()) {
    EXPECT_EQ(solid->interface_sides(cell) & solid->boundary_sides(cell), 0);
    for (int side = 0; side < 6; ++side) {
      Vec3 middle = Vec3::Constant(0.5);
      middle[side / 2] = side % 2;
      const bool is_interface = (solid->interface_sides(cell) >> side & 1) != 0;
      EXPECT_EQ(is_interface, std::abs(evaluator.geo({cell, middle}).x() - 10) < 1e-9) << "cell " << cell;
      interfaces[solid->region_of(solid->control_cell(cell))] += is_interface;
    }
  }
  EXPECT_EQ(interfaces[0], interfaces[1]);
}
}  // namespace
}  // namespace ccslice
