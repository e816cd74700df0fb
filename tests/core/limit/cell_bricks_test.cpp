// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_data.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/subdivision/refined_mesh.h"
#include "tests/support/brute_force_topology.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// With sharp edges: all cells are regular.
ControlMesh sharp_box(int x, int y, int z) {
  BoxShape shape;
  shape.cells_x = x, shape.cells_y = y, shape.cells_z = z;
  shape.size_mm = Vec3(x, y, z);
  return make_box(shape);
}

/// Moves its vertices, and begins each hexahedron at a random corner, along a random edge.
ControlMesh turned(ControlMesh mesh, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> move(-0.1, 0.1);
  for (Vec3& vertex : mesh.positions) vertex += Vec3(move(random), move(random), move(random));
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    Frame frame = frame_at(static_cast<std::uint8_t>(random() % 8), static_cast<std::uint8_t>(random() % 3));
    std::array<std::uint32_t, 8> corners;
    for (std::size_t v = 0; v < 8; ++v) corners[oracle::kVtkCorner[v]] = mesh.cell_vertices[8 * cell + v];
    for (std::size_t v = 0; v < 8; ++v) {
      mesh.cell_vertices[8 * cell + v] = corners[frame.corner(static_cast<unsigned>(oracle::kVtkCorner[v]))];
    }
  }
  return mesh;
}

std::map<std::size_t, int> sizes_of(const CellBricks& bricks) {
  std::map<std::size_t, int> sizes;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) ++sizes[bricks[b].cell_count()];
  return sizes;
}

using Sizes = std::map<std::size_t, int>;

TEST(CellBricks, FillAStructuredMesh) {
  EXPECT_EQ(sizes_of(prepare_solid(refine_mesh(make_ring(), 1))->data().bricks), (Sizes{{64, 64}}));
  EXPECT_EQ(sizes_of(prepare_solid(sharp_box(8, 4, 5))->data().bricks), (Sizes{{64, 2}}));
}

TEST(CellBricks, AreTheSameHoweverCellsAreTurned) {
  const auto solid = prepare_solid(turned(sharp_box(8, 8, 4), 1));
  const CellBricks& bricks = solid->data().bricks;
  std::size_t cells = 0;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) cells += bricks[b].cell_count();
  EXPECT_GE(cells, 240U);
  EXPECT_LE(bricks.size(), 12U);
}

// A brick's parameters tell the cells that they name: where two of its cells meet, both have the same limit there, and
// that of the brick goes on from one to the other without a kink.
TEST(CellBricks, MapTheirParametersToThoseOfTheirCells) {
  const auto solid = prepare_solid(turned(sharp_box(7, 6, 5), 2));
  const CellBricks& bricks = solid->data().bricks;
  LimitEvaluator evaluator(*solid);
  constexpr double kStep = 1e-5;
  ASSERT_GT(bricks.size(), 0U);
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    const CellBrick& brick = bricks[b];
    for (int axis = 0; axis < 3; ++axis) {
      for (int knot = 1; knot < brick.cells[static_cast<std::size_t>(axis)]; ++knot) {
        Vec3 at(0.3, 0.4, 0.6), step = Vec3::Zero();
        at[axis] = knot, step[axis] = kStep;
        const auto limit = [&](const Vec3& place) { return evaluator.geo(bricks.cell_param(brick, place)); };
        EXPECT_NE(bricks.cell_param(brick, at - step).cell, bricks.cell_param(brick, at + step).cell);
        const Vec3 before = (limit(at) - limit(at - step)) / kStep, after = (limit(at + step) - limit(at)) / kStep;
        EXPECT_LT((after - before).norm(), 1e-3 * before.norm()) << b << " " << axis << " " << knot;
      }
    }
  }
}

/// Lists its hexahedra in another order: bricks begin anywhere, and find others in their way.
ControlMesh shuffled(ControlMesh mesh, std::uint32_t seed) {
  std::vector<std::array<std::uint32_t, 8>> cells(mesh.cell_count());
  for (std::size_t n = 0; n < mesh.cell_vertices.size(); ++n) cells[n / 8][n % 8] = mesh.cell_vertices[n];
  std::mt19937 random(seed);
  for (std::size_t n = cells.size(); n > 1; --n) std::swap(cells[n - 1], cells[random() % n]);
  for (std::size_t n = 0; n < mesh.cell_vertices.size(); ++n) mesh.cell_vertices[n] = cells[n / 8][n % 8];
  return mesh;
}

TEST(CellBricks, HoldEachRegularCellAtMostOnce) {
  std::vector<oracle::TinyMesh> meshes = oracle::tiny_meshes();
  meshes.push_back({"a rest too small for a brick", sharp_box(5, 4, 4)});
  meshes.push_back({"bricks that leave gaps", shuffled(turned(sharp_box(9, 8, 7), 4), 4)});
  for (const auto& [name, mesh] : meshes) {
    const auto solid = prepare_solid(mesh);
    const CellBricks& bricks = solid->data().bricks;
    std::vector<int> seen(solid->cell_count());
    for (std::uint32_t b = 0; b < bricks.size(); ++b) {
      for (const CellBricks::Cell& cell : bricks.cells(bricks[b])) {
        ++seen[cell.cell];
        EXPECT_EQ(bricks.brick_of(cell.cell), b) << name;
        EXPECT_EQ(solid->cell_class(cell.cell), CellClass::kRegular) << name;
      }
    }
    for (const LimitCellId cell : solid->cells()) {
      EXPECT_EQ(seen[cell], bricks.brick_of(cell) == kNone ? 0 : 1) << name;
    }
  }
}

/// Round the z axis, with sharp edges: all cells are regular.
ControlMesh sharp_tube(std::uint32_t sectors, std::uint32_t cells_across) {
  ControlMesh mesh;
  const std::uint32_t across = cells_across + 1;
  for (std::uint32_t v = 0; v < sectors * across * across; ++v) {
    const double angle = 2 * EIGEN_PI * (v / (across * across)) / sectors, radius = 10.0 + v / across % across;
    mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), v % across);
  }
  const auto vertex = [&](std::uint32_t s, std::uint32_t r, std::uint32_t z) {
    return (s % sectors * across + r) * across + z;
  };
  for (std::uint32_t c = 0; c < sectors * cells_across * cells_across; ++c) {
    const std::uint32_t s = c / (cells_across * cells_across), r = c / cells_across % cells_across,
                        z = c % cells_across;
    mesh.cell_kinds.push_back(CellKind::kHex);
    for (const std::uint32_t up : {0U, 1U}) {
      for (const auto& [ahead, out] : {std::pair{0U, 0U}, {0U, 1U}, {1U, 1U}, {1U, 0U}}) {
        mesh.cell_vertices.push_back(vertex(s + ahead, r + out, z + up));
      }
    }
  }
  oracle::sharpen_by_cells(mesh, 1);
  return mesh;
}

// Three cells round a hole: a brick that went on round it would meet itself.
TEST(CellBricks, DoNotMeetThemselves) {
  for (const std::uint32_t sectors : {3U, 4U, 5U, 6U}) {
    const auto solid = prepare_solid(sharp_tube(sectors, 4));
    const CellBricks& bricks = solid->data().bricks;
    ASSERT_GT(bricks.size(), 0U);
    EXPECT_EQ(bricks[0].cell_count(), 16 * std::min(sectors, 4U));
    for (std::uint32_t b = 0; b < bricks.size(); ++b) {
      std::vector<LimitCellId> cells;
      for (const CellBricks::Cell& cell : bricks.cells(bricks[b])) cells.push_back(cell.cell);
      std::ranges::sort(cells);
      EXPECT_EQ(std::ranges::adjacent_find(cells), cells.end());
    }
  }
}

TEST(CellBricks, KnowTheirSidesOnTheBoundary) {
  const auto solid = prepare_solid(sharp_box(8, 4, 4));
  const CellBricks& bricks = solid->data().bricks;
  ASSERT_EQ(bricks.size(), 2U);
  for (std::uint32_t b = 0; b < 2; ++b) {
    const CellBrick& brick = bricks[b];
    EXPECT_EQ(std::popcount(brick.boundary_sides), 5);
    EXPECT_EQ(brick.phantoms, brick.boundary_sides);
  }
}

TEST(CellBricks, KnowThemHoweverCellsAreTurned) {
  const auto solid = prepare_solid(turned(sharp_box(9, 5, 4), 3));
  const CellBricks& bricks = solid->data().bricks;
  ASSERT_GT(bricks.size(), 0U);
  for (std::uint32_t b = 0; b < bricks.size(); ++b) EXPECT_EQ(bricks[b].phantoms, bricks[b].boundary_sides);
}

TEST(CellBricks, EndBetweenCellRegionsAndAreNoneAsMeshed) {
  ControlMesh mesh = sharp_box(8, 4, 4);
  const ControlMesh parted = oracle::with_regions(mesh, 2, [](const Vec3& middle) { return middle.x() < 2.5 ? 0 : 1; });
  const auto solid = prepare_solid(parted);
  const CellBricks& bricks = solid->data().bricks;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    const std::span<const CellBricks::Cell> cells = bricks.cells(bricks[b]);
    const auto region = [&](const CellBricks::Cell& cell) { return solid->region_of(solid->control_cell(cell.cell)); };
    for (const CellBricks::Cell& cell : cells) EXPECT_EQ(region(cell), region(cells[0]));
  }
  mesh.sharp_edges.clear();
  mesh.sharp_vertices.clear();
  mesh.as_meshed = true;
  EXPECT_EQ(prepare_solid(mesh)->data().bricks.size(), 0U);
}

}  // namespace
}  // namespace ccslice
