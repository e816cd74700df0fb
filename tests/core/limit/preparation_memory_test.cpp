// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What PrepareOptions::reserve is told, against what is allocated meanwhile.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/limit/deviation.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/models.h"
#include "core/vertex_fit/vertex_fit.h"
#include "tests/support/allocation_count.h"
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

std::vector<std::pair<std::string, ControlMesh>> meshes() {
  ControlMesh sharp = oracle::box_mesh(12, 12, 12);
  oracle::sharpen_by_cells(sharp, 1);
  oracle::add_random_channels(sharp, 2, 3);
  ControlMesh overlapping = oracle::kuhn_box(6), folding = oracle::folding_box_mesh();
  oracle::append_mesh(overlapping, oracle::kuhn_box(6), Vec3::Constant(3));
  folding.allow_folds = true;
  return {
      {"overlapping tetrahedra", overlapping},
      {"folds", folding},
      {"smooth box", oracle::box_mesh(12, 12, 12)},
      {"sharp box", sharp},
      {"tetrahedra", oracle::kuhn_box(4)},
      {"tetrahedra in several cut-outs", oracle::kuhn_box(8)},
      {"lone tetrahedra", lone_cells(CellKind::kTet, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}})},
      {"lone wedges", lone_cells(CellKind::kWedge, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}})},
      {"coyote", find_sample_model("coyote")->make()},
      {"engine", find_sample_model("engine")->make()}};
}

TEST(PreparationMemory, IsAskedForBeforeItIsTaken) {
  for (const int threads : {1, 2}) {
    for (auto& [name, mesh] : meshes()) {
      Bookkeeper bookkeeper(name + ", threads: " + std::to_string(threads));
      PrepareOptions options;
      options.threads = threads;
      options.reserve = [&](std::uint64_t bytes) { bookkeeper.ask(bytes); };
      const auto solid = LimitSolid::prepare(std::move(mesh), options);
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
