// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <thread>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_data.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/models.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(LimitSolid, RefinesOnlyCellsThatNeedIt) {
  // A smooth box of four cells a side has no cell with two lines or two corners; one of three has.
  EXPECT_EQ(LimitSolid::prepare(oracle::box_mesh(4, 4, 4))->cell_count(), 64u);
  EXPECT_EQ(LimitSolid::prepare(oracle::box_mesh(1, 1, 1))->cell_count(), 8u);
  ControlMesh mixed = oracle::box_mesh(9, 4, 4);
  // One sharp edge alone: two chain ends in one cell.
  oracle::sharpen(mixed, [](const Vec3& a, const Vec3& b) { return a == Vec3(40, 20, 0) && b == Vec3(50, 20, 0); });
  const auto solid = LimitSolid::prepare(mixed);
  EXPECT_GT(solid->cell_count(), 144u);
  EXPECT_LT(solid->cell_count(), 144u + 7 * 10);
}

// Sheared boxes hold all of their cells, and little else where cells are straight.
TEST(LimitSolid, KnowsWhichPointsACellMayHold) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = LimitSolid::prepare(mesh);
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
  const auto solid = LimitSolid::prepare(sheared);
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
    const auto solid = LimitSolid::prepare(mesh);
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
  const auto solid = LimitSolid::prepare(oracle::box_mesh(12, 1, 1));
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
  const auto solid = LimitSolid::prepare(fan);
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
  const auto solid = LimitSolid::prepare(mesh);
  EXPECT_GE(solid->summary().undecided_cells, 2u);
  EXPECT_EQ(solid->summary().folding_cells, 0u);
  EXPECT_TRUE(solid->summary().folds.empty());
}

TEST(LimitSolid, CountsExtraordinaryVerticesOfTheControlMesh) {
  std::size_t meshes = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    meshes += LimitSolid::prepare(mesh)->summary().extraordinary_vertices > 0;
  }
  EXPECT_GE(meshes, 2u);
}

TEST(LimitSolid, BoxOfASharpBoxIsTheBox) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2, 5);
  oracle::sharpen_by_cells(mesh, 1);
  const Box3 box = LimitSolid::prepare(mesh)->summary().bounding_box;
  EXPECT_LT(box.min().norm(), 1e-12);
  EXPECT_LT((box.max() - Vec3::Constant(10)).norm(), 1e-12);
}

TEST(LimitSolid, BoundingBoxHoldsTheLimitAndIsTouchedByIt) {
  std::mt19937 random(11);
  for (const std::string name : {"single_hex", "single_tet", "hollow_cube"}) {
    const auto found = std::find_if(oracle::tiny_meshes().begin(), oracle::tiny_meshes().end(),
                                    [&](const auto& tiny) { return tiny.name == name; });
    if (found == oracle::tiny_meshes().end()) continue;
    const auto solid = LimitSolid::prepare(found->mesh);
    Placement turn = Placement::Identity();
    turn.rotate(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())).translate(Vec3(5, -3, 2));
    const Box3 box = solid->placed_bounding_box(turn);
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
  EXPECT_THROW(LimitSolid::prepare(mesh), Error);
  mesh.allow_folds = true;
  const auto solid = LimitSolid::prepare(mesh);
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

std::vector<double> numbers_of(const LimitSolid& solid) {
  std::vector<double> numbers;
  const auto put = [&](const auto& values) { numbers.insert(numbers.end(), values.begin(), values.end()); };
  for (const LimitCellId c : solid.cells()) {
    const CellMap map = solid.index().cell_maps[c];
    put(map.middle);
    put(map.inverse_jacobian.reshaped());
    put(map.hull.min());
    put(map.hull.max());
    put(solid.index().cell_boxes.box(c).min());
    put(solid.index().cell_boxes.box(c).max());
  }
  put(solid.index().fold_cells);
  for (const FoldPlace& fold : solid.summary().folds) {
    put(fold.position);
    numbers.push_back(fold.determinant);
  }
  numbers.push_back(static_cast<double>(solid.summary().undecided_cells));
  numbers.push_back(solid.summary().deviation.limit_volume_mm3);
  for (const CellRegionSummary& region : solid.summary().cell_regions) numbers.push_back(region.volume_mm3);
  return numbers;
}

// Large enough for several ranges of cells and of faces, with folds, boundary and an interface.
TEST(LimitSolid, IsTheSameForAnyNumberOfThreads) {
  ControlMesh mesh = oracle::box_mesh(9, 9, 9);
  oracle::jitter(mesh, 9, 5);
  mesh.allow_folds = true;
  mesh.cell_region_names = {"core", "shell"};
  for (std::uint32_t c = 0; c < mesh.cell_count(); ++c) mesh.cell_regions.push_back(c % 9 < 4 ? 0 : 1);
  const auto one = LimitSolid::prepare(mesh);
  EXPECT_GT(one->summary().folding_cells, 10u);
  const std::vector<double> expected = numbers_of(*one);
  PrepareOptions options;
  for (const int threads : {2, 8}) {
    options.threads = threads;
    EXPECT_EQ(numbers_of(*LimitSolid::prepare(mesh, options)), expected) << threads << " threads";
  }
}

// Under ThreadSanitizer everything takes some ten times as long.
#ifdef __SANITIZE_THREAD__
constexpr std::chrono::milliseconds kLate(1000);
#else
constexpr std::chrono::milliseconds kLate(100);
#endif

TEST(LimitSolid, CancelsWithinAHundredMillisecondsAtAnyTime) {
  // Cancelled at twelve moments of a preparation that takes much longer than the bound. Three late stops are put down
  // to a busy machine, and to sanitizers.
  constexpr int kMoments = 12;
  using Clock = std::chrono::steady_clock;
  const ControlMesh mesh = oracle::box_mesh(40, 40, 40);
  const auto begin = Clock::now();
  (void)LimitSolid::prepare(mesh);
  const Clock::duration whole = Clock::now() - begin;
  int late = 0, stopped_early = 0;
  for (int moment = 0; moment < kMoments; ++moment) {
    PrepareOptions options;
    options.cancel = CancellationToken::make();
    Clock::time_point cancelled;
    std::jthread canceller([&] {
      std::this_thread::sleep_for(moment * whole / kMoments);
      cancelled = Clock::now();
      options.cancel.cancel();
    });
    try {
      (void)LimitSolid::prepare(mesh, options);
      continue;  // Done before it was cancelled.
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kCancelled);
    }
    const auto stopped = Clock::now();
    canceller.join();
    ++stopped_early;
    late += stopped - cancelled > kLate;
  }
  EXPECT_LE(late, 3);
  EXPECT_GT(stopped_early, 0);
}

TEST(LimitSolid, CancelsWhilePreparing) {
  PrepareOptions options;
  options.cancel = CancellationToken::make();
  options.cancel.cancel();
  try {
    (void)LimitSolid::prepare(oracle::box_mesh(3, 3, 3), options);
    FAIL() << "went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

TEST(LimitSolid, IsTheSameWheneverItIsPrepared) {
  const ControlMesh& mesh = oracle::tiny_mesh("hollow_cube");
  const auto first = LimitSolid::prepare(mesh), second = LimitSolid::prepare(mesh);
  LimitEvaluator a(*first), b(*second);
  for (const LimitCellId c : first->cells()) {
    EXPECT_EQ(a.geo({c, Vec3(0.1, 0.01, 0.7)}), b.geo({c, Vec3(0.1, 0.01, 0.7)}));
  }
}

TEST(LimitSolid, KeepsARegularCellUnderThreeQuartersOfAKilobyte) {
  ControlMesh mesh = oracle::box_mesh(20, 20, 20);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::add_random_channels(mesh, 1, 3);
  const auto solid = LimitSolid::prepare(mesh);
  const SolidSummary& summary = solid->summary();
  EXPECT_EQ(summary.regular_cells, 8000u);
  EXPECT_LT(summary.memory_bytes, 8000u * 768);
}

// However many cells meet at their vertices, tetrahedra share the operators of few rings.
TEST(LimitSolid, KeepsATetrahedronUnderTenAndAHalfKilobytes) {
  const ControlMesh mesh = oracle::kuhn_box(4);
  std::uint64_t asked = 0;
  PrepareOptions options;
  options.reserve = [&](std::uint64_t bytes) { asked = bytes; };
  const auto solid = LimitSolid::prepare(mesh, options);
  EXPECT_EQ(solid->summary().limit_cells, 32 * mesh.cell_count());
  EXPECT_LT(solid->summary().memory_bytes, 10'500 * mesh.cell_count());
  EXPECT_LT(asked, 44'000 * mesh.cell_count());
  EXPECT_LT(solid->data().operators.corners().size(), 300u);
}

// Children of one cell list the points that they have in common once, and there are few orders to pick them in.
TEST(LimitSolid, SharesTheRingsOfChildren) {
  const auto solid = LimitSolid::prepare(oracle::kuhn_box(4));
  const LimitSolid::Data& data = solid->data();
  std::size_t points = 0;
  for (const LimitCell& cell : data.cells) {
    const CellRing ring = data.ring(cell);
    points += ring.size();
    std::set<std::uint32_t> different;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      if (ring[i] == kNone) continue;
      EXPECT_LT(ring[i], data.points.size() / data.dimension);
      EXPECT_TRUE(different.insert(ring[i]).second);
    }
  }
  EXPECT_LT(data.rings.size(), points / 2);
  EXPECT_LT(data.ring_orders.size(), points / 4);
}

// A client that asks beforehand doesn't know how many a server has.
TEST(LimitSolid, AsksForAsMuchMemoryOnAnyNumberOfThreads) {
  const auto asked_by = [](int threads) {
    std::vector<std::uint64_t> asked;
    PrepareOptions options;
    options.threads = threads;
    options.reserve = [&](std::uint64_t bytes) { asked.push_back(bytes); };
    EXPECT_GT(LimitSolid::prepare(oracle::kuhn_box(3), options)->summary().limit_cells, 0u);
    return asked;
  };
  const std::vector<std::uint64_t> alone = asked_by(1);
  EXPECT_EQ(alone, asked_by(2));
  EXPECT_EQ(alone, asked_by(16));
}

TEST(LimitSolid, AsksForMemoryBeforeItTakesIt) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    std::vector<std::uint64_t> asked;
    PrepareOptions options;
    options.reserve = [&](std::uint64_t bytes) { asked.push_back(bytes); };
    const auto solid = LimitSolid::prepare(mesh, options);
    ASSERT_FALSE(asked.empty()) << name;
    EXPECT_TRUE(std::is_sorted(asked.begin(), asked.end())) << name;
    EXPECT_GT(asked.back(), solid->summary().memory_bytes) << name;
  }
}

// Three boxes round an edge along each axis: those of the middle box are on the boundary, the reentrant one too.
TEST(LimitSolid, HasEdgesOnTheBoundary) {
  for (int along = 0; along < 3; ++along) {
    const auto solid =
        LimitSolid::prepare(oracle::box_mesh(along == 0 ? 1 : 2, along == 1 ? 1 : 2, along == 2 ? 1 : 2, 10,
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
  const auto solid = LimitSolid::prepare(
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
  const auto solid = LimitSolid::prepare(
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

// So nothing of a mesh of tetrahedra is refined where there is too little memory: their kind tells how many cells come.
TEST(LimitSolid, AsksForNearlyAllMemoryOfTetrahedraAtFirst) {
  std::vector<std::uint64_t> asked;
  PrepareOptions options;
  options.reserve = [&](std::uint64_t bytes) { asked.push_back(bytes); };
  const ControlMesh mesh = oracle::kuhn_box(6);
  EXPECT_EQ(LimitSolid::prepare(mesh, options)->summary().control_cells, mesh.cell_count());
  EXPECT_GT(static_cast<double>(asked.front()), 0.8 * static_cast<double>(asked.back()));
}

// Boundary faces count, of which such cells have the most.
TEST(LimitSolid, AsksForTheMemoryOfCellsThatShareNothing) {
  ControlMesh cell = oracle::box_mesh(1, 1, 1), mesh;
  oracle::sharpen_by_cells(cell, 1);
  for (std::uint32_t i = 0; i < 4096; ++i) {
    oracle::append_mesh(mesh, cell, 20.0 * Vec3(i % 16, i / 16 % 16, i / 256));
  }
  std::uint64_t asked = 0;
  PrepareOptions options;
  options.reserve = [&](std::uint64_t bytes) { asked = bytes; };
  const auto solid = LimitSolid::prepare(mesh, options);
  EXPECT_EQ(solid->summary().boundary_faces, 6 * 4096u);
  EXPECT_GT(asked, 3 * solid->summary().memory_bytes / 2);
}

TEST(LimitSolid, IsNotPreparedWhereThereIsTooLittleMemory) {
  struct Refused {};
  PrepareOptions options;
  options.reserve = [](std::uint64_t bytes) {
    if (bytes > 1'500'000) throw Refused();
  };
  EXPECT_NO_THROW(LimitSolid::prepare(oracle::box_mesh(3, 3, 3), options));
  EXPECT_THROW(LimitSolid::prepare(oracle::box_mesh(9, 9, 9), options), Refused);
}

}  // namespace
}  // namespace ccslice
