// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How a solid is prepared (core/limit/limit_solid.h): threads, cancellation, memory, and what it keeps.

#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

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
  const auto one = prepare_solid(mesh);
  EXPECT_GT(one->summary().folding_cells, 10u);
  const std::vector<double> expected = numbers_of(*one);
  PrepareOptions options;
  for (const int threads : {2, 8}) {
    options.threads = threads;
    EXPECT_EQ(numbers_of(*prepare_solid(mesh, options)), expected) << threads << " threads";
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
  (void)prepare_solid(mesh);
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
      (void)prepare_solid(mesh, options);
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
    (void)prepare_solid(oracle::box_mesh(3, 3, 3), options);
    FAIL() << "went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

TEST(LimitSolid, IsTheSameWheneverItIsPrepared) {
  const ControlMesh& mesh = oracle::tiny_mesh("hollow_cube");
  const auto first = prepare_solid(mesh), second = prepare_solid(mesh);
  LimitEvaluator a(*first), b(*second);
  for (const LimitCellId c : first->cells()) {
    EXPECT_EQ(a.geo({c, Vec3(0.1, 0.01, 0.7)}), b.geo({c, Vec3(0.1, 0.01, 0.7)}));
  }
}

TEST(LimitSolid, KeepsARegularCellUnderThreeQuartersOfAKilobyte) {
  ControlMesh mesh = oracle::box_mesh(20, 20, 20);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::add_random_channels(mesh, 1, 3);
  const auto solid = prepare_solid(mesh);
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
  const auto solid = prepare_solid(mesh, options);
  EXPECT_EQ(solid->summary().limit_cells, 32 * mesh.cell_count());
  EXPECT_LT(solid->summary().memory_bytes, 10'500 * mesh.cell_count());
  EXPECT_LT(asked, 44'000 * mesh.cell_count());
  EXPECT_LT(solid->data().operators.corners().size(), 300u);
}

// Children of one cell list the points that they have in common once, and there are few orders to pick them in.
TEST(LimitSolid, SharesTheRingsOfChildren) {
  const auto solid = prepare_solid(oracle::kuhn_box(4));
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
    EXPECT_GT(prepare_solid(oracle::kuhn_box(3), options)->summary().limit_cells, 0u);
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
    const auto solid = prepare_solid(mesh, options);
    ASSERT_FALSE(asked.empty()) << name;
    EXPECT_TRUE(std::is_sorted(asked.begin(), asked.end())) << name;
    EXPECT_GT(asked.back(), solid->summary().memory_bytes) << name;
  }
}

// So nothing of a mesh of tetrahedra is refined where there is too little memory: their kind tells how many cells come.
TEST(LimitSolid, AsksForNearlyAllMemoryOfTetrahedraAtFirst) {
  std::vector<std::uint64_t> asked;
  PrepareOptions options;
  options.reserve = [&](std::uint64_t bytes) { asked.push_back(bytes); };
  const ControlMesh mesh = oracle::kuhn_box(6);
  EXPECT_EQ(prepare_solid(mesh, options)->summary().control_cells, mesh.cell_count());
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
  const auto solid = prepare_solid(mesh, options);
  EXPECT_EQ(solid->summary().boundary_faces, 6 * 4096u);
  EXPECT_GT(asked, 3 * solid->summary().memory_bytes / 2);
}

TEST(LimitSolid, IsNotPreparedWhereThereIsTooLittleMemory) {
  struct Refused {};
  PrepareOptions options;
  options.reserve = [](std::uint64_t bytes) {
    if (bytes > 1'500'000) throw Refused();
  };
  EXPECT_NO_THROW(prepare_solid(oracle::box_mesh(3, 3, 3), options));
  EXPECT_THROW(prepare_solid(oracle::box_mesh(9, 9, 9), options), Refused);
}

}  // namespace
}  // namespace ccslice
