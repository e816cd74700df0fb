// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What PrepareOptions::reserve is told, against what is allocated meanwhile.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/limit/limit_solid.h"
#include "core/mesh/cell_kind.h"
#include "core/models/models.h"
#include "core/prepare/deviation.h"
#include "core/prepare/prepare_solid.h"
#include "core/vertex_fit/vertex_fit.h"
#include "tests/support/allocation_count.h"
#include "tests/support/finite_elements.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Compares, each time that more is asked for, what was taken until then with what had been asked for.
class Bookkeeper {
 public:
  explicit Bookkeeper(std::string what) : what_(std::move(what)) {}

  void ask(std::uint64_t bytes) {
    if (asked_bytes_ == 0) {
      EXPECT_LT(held_.most_bytes(), bytes / 3) << what_ << ": what the mesh itself takes, before anything is known";
    } else {
      EXPECT_LE(held_.most_bytes(), asked_bytes_) << what_;
    }
    asked_bytes_ = bytes;
  }
  void end() const {
    EXPECT_LE(held_.most_bytes(), asked_bytes_) << what_;
    EXPECT_GT(held_.most_bytes(), asked_bytes_ / 4) << what_ << ": so much more was never taken";
  }

 private:
  const std::string what_;
  const oracle::HeldMemory held_;
  std::uint64_t asked_bytes_ = 0;
};

/// Cells of these corners that share nothing, more than one cut-out has.
ControlMesh lone_cells(CellKind kind, const std::vector<Vec3>& corners) {
  ControlMesh cell, mesh;
  cell.positions = corners;
  cell.cell_kinds = {kind};
  for (std::uint32_t i = 0; i < corners.size(); ++i) cell.cell_vertices.push_back(i);
  for (std::uint32_t i = 0; i < 700; ++i) {
    oracle::append_mesh(mesh, cell, 2.0 * Vec3(i % 8, i / 8 % 8, i / 64));
  }
  return mesh;
}

/// As many tetrahedra round one vertex as may be: a box of 4 x 4 x 6 squares, each cut in two, with the middle.
ControlMesh tetrahedra_round_a_vertex() {
  constexpr std::array<int, 3> kSquares = {4, 4, 6};
  ControlMesh mesh;
  mesh.positions = {Vec3(2, 2, 3)};
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, fresh] = known.try_emplace(at, static_cast<std::uint32_t>(mesh.positions.size()));
    if (fresh) mesh.positions.emplace_back(at[0], at[1], at[2]);
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (int square = 0; square < 2 * kSquares[a] * kSquares[b]; ++square) {
      std::array<int, 3> corner{};
      corner[axis] = square % 2 * kSquares[axis];
      corner[a] = square / 2 % kSquares[a];
      corner[b] = square / 2 / kSquares[a];
      std::array<std::uint32_t, 4> ring{};  // Counter-clockwise along the axis.
      for (std::size_t i = 0; i < 4; ++i) {
        std::array<int, 3> at = corner;
        at[a] += i == 1 || i == 2;
        at[b] += i >= 2;
        ring[i] = vertex(at);
      }
      for (const std::size_t i : {1u, 2u})
        mesh.cell_vertices.insert(mesh.cell_vertices.end(), {0, ring[0], ring[i], ring[i + 1]});
    }
  }
  mesh.cell_kinds.assign(mesh.cell_vertices.size() / 4, CellKind::kTet);
  return mesh;
}

ControlMesh many_fans() {
  const ControlMesh fan = oracle::fan_mesh(64, 1, 4);
  ControlMesh mesh;
  for (int i = 0; i < 15; ++i) oracle::append_mesh(mesh, fan, Vec3(100 * i, 0, 0));
  return mesh;
}

/// Fans of a hexahedron and 63 wedges, one above the other, round an edge inside or on the boundary.
ControlMesh hexahedron_among_wedges(std::uint32_t layers, double degrees) {
  constexpr std::uint32_t kCells = 64;
  const std::uint32_t spokes = degrees == 360 ? kCells : kCells + 1;
  const std::uint32_t points = spokes + 2;  // Of a layer: the axis, a ring, a corner of the hexahedron.
  const double step = degrees * std::numbers::pi / 180 / kCells;
  ControlMesh mesh;
  for (std::uint32_t layer = 0; layer <= layers; ++layer) {
    const auto at = [&](double turn, double radius) {
      return Vec3(radius * std::cos(turn), radius * std::sin(turn), 5.0 * layer);
    };
    mesh.positions.push_back(at(0, 0));
    for (std::uint32_t i = 0; i < spokes; ++i) mesh.positions.push_back(at(step * i, 30));
    mesh.positions.push_back(at(step / 2, 32));
  }
  const auto add = [&](CellKind kind, std::initializer_list<std::uint32_t> corners) {
    mesh.cell_kinds.push_back(kind);
    mesh.cell_vertices.insert(mesh.cell_vertices.end(), corners);
  };
  for (std::uint32_t layer = 0; layer < layers; ++layer) {
    const std::uint32_t low = layer * points, high = low + points, corner = spokes + 1;
    add(CellKind::kHex, {low, low + 1, low + corner, low + 2, high, high + 1, high + corner, high + 2});
    for (std::uint32_t i = 1; i < kCells; ++i) {
      const std::uint32_t a = i + 1, b = (i + 1) % spokes + 1;
      add(CellKind::kWedge, {low, low + b, low + a, high, high + b, high + a});
    }
  }
  return mesh;
}

/// Cells in any order, and one of them far away from all others.
ControlMesh with_a_far_cell(int cells) {
  const ControlMesh box = oracle::kuhn_box(cells);
  std::vector<std::size_t> order(box.cell_count());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  ControlMesh mesh;
  mesh.positions = box.positions;
  mesh.cell_kinds = box.cell_kinds;
  for (const std::size_t cell : order) {
    for (std::size_t corner = 0; corner < 4; ++corner) {
      mesh.cell_vertices.push_back(box.cell_vertices[4 * cell + corner]);
    }
  }
  ControlMesh lone;
  lone.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  lone.cell_kinds = {CellKind::kTet};
  lone.cell_vertices = {0, 1, 2, 3};
  oracle::append_mesh(mesh, lone, Vec3(1e5, 0, 0));
  return mesh;
}

/// Folds in most of its cells.
ControlMesh crumpled(ControlMesh mesh, double amplitude_mm) {
  oracle::jitter(mesh, amplitude_mm, 5);
  mesh.allow_folds = true;
  return mesh;
}

std::vector<std::pair<std::string, ControlMesh>> meshes() {
  ControlMesh sharp = oracle::box_mesh(12, 12, 12);
  oracle::sharpen_by_cells(sharp, 1);
  oracle::add_random_channels(sharp, 2, 3);
  ControlMesh overlapping = oracle::kuhn_box(6), folding = oracle::folding_box_mesh();
  oracle::append_mesh(overlapping, oracle::kuhn_box(6), Vec3::Constant(3));
  folding.allow_folds = true;
  ControlMesh as_meshed = oracle::kuhn_box(6), of_second_order = oracle::kuhn_box(4);
  as_meshed.as_meshed = of_second_order.as_meshed = true;
  oracle::add_random_mid_nodes(0.02, false, 5, of_second_order);
  ControlMesh all_at_once = oracle::kuhn_box(3);
  oracle::append_mesh(all_at_once, oracle::kuhn_box(3), Vec3::Constant(3));
  return {
      {"overlapping tetrahedra", overlapping},
      {"folds", folding},
      {"folds in most hexahedra", crumpled(oracle::box_mesh(8, 8, 8), 15)},
      {"folds in most tetrahedra", crumpled(oracle::kuhn_box(4), 8)},
      {"folds in all tetrahedra", crumpled(oracle::kuhn_box(12), 30)},
      {"a tetrahedron far away", with_a_far_cell(10)},
      {"folds in most tetrahedra that overlap", crumpled(all_at_once, 8)},
      {"folds in fans of wedges and a hexahedron", hexahedron_among_wedges(3, 290)},
      {"64 cells round an edge", oracle::fan_mesh(64, 1, 2)},
      {"64 cells round an edge of the boundary", oracle::fan_mesh(64, 1, 2, 270)},
      {"many fans", many_fans()},
      {"64 cells round an edge, a hexahedron first", hexahedron_among_wedges(40, 360)},
      {"256 tetrahedra round a vertex", tetrahedra_round_a_vertex()},
      {"smooth box", oracle::box_mesh(12, 12, 12)},
      {"sharp box", sharp},
      {"tetrahedra", oracle::kuhn_box(4)},
      {"tetrahedra in several cut-outs", oracle::kuhn_box(8)},
      {"lone tetrahedra", lone_cells(CellKind::kTet, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}})},
      {"lone wedges", lone_cells(CellKind::kWedge, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}})},
      {"tetrahedra as meshed", as_meshed},
      {"tetrahedra of second order", of_second_order},
      {"coyote", find_sample_model("coyote")->make()},
      {"engine", find_sample_model("engine")->make()}};
}

TEST(PreparationMemory, IsAskedForBeforeItIsTaken) {
  for (const int threads : {1, 2}) {
    for (auto& [name, mesh] : meshes()) {
      if (threads > 1 && mesh.cell_count() > 10'000) continue;  // It takes ten seconds.
      Bookkeeper bookkeeper(name + ", threads: " + std::to_string(threads));
      PrepareOptions options;
      options.threads = threads;
      options.reserve = [&](std::uint64_t bytes) { bookkeeper.ask(bytes); };
      const auto solid = prepare_solid(std::move(mesh), options);
      bookkeeper.end();
    }
  }
}

TEST(PreparationMemory, IsAskedForBeforeALimitIsMeasured) {
  for (auto& [name, mesh] : meshes()) {
    Bookkeeper bookkeeper(name);
    PrepareOptions options;
    options.reserve = [&](std::uint64_t bytes) { bookkeeper.ask(bytes); };
    (void)measure_limit(std::move(mesh), options);
  }
}

/// Each time that a fit prepares its mesh: what is held of the time before is given back until then.
TEST(PreparationMemory, IsAskedForBeforeAFitLooksForFolds) {
  const ControlMesh mesh = oracle::box_mesh(12, 12, 12);
  FitOptions options;
  std::optional<Bookkeeper> bookkeeper;
  PreparationProgress progress;
  std::size_t prepared = 0;
  options.progress.preparing = [&] {
    bookkeeper.emplace("round " + std::to_string(prepared++));
    return &progress;
  };
  options.progress.reserve = [&](std::uint64_t bytes) { bookkeeper->ask(bytes); };
  FitReport report;
  (void)VertexFit(mesh, options).fit_positions(FittedVertices::kAll, report);
  ASSERT_GT(prepared, 0u);
  bookkeeper->end();
}

}  // namespace
}  // namespace ccslice
