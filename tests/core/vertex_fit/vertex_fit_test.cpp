// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/vertex_fit/vertex_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/prepare/deviation.h"
#include "core/prepare/prepare_solid.h"
#include "core/subdivision/refined_mesh.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/brute_force.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Layers so uneven that a smooth curve through their heights runs backwards.
ControlMesh uneven_box() {
  ControlMesh mesh = oracle::box_mesh(5, 5, 5, 1);
  constexpr std::array kPlaces = {0.0, 1.0, 1.02, 2.0, 2.02, 3.0};
  for (Vec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) p[axis] = kPlaces[static_cast<std::size_t>(std::lround(p[axis]))];
  }
  return mesh;
}

/// A cube whose corners no smooth limit meets.
ControlMesh dented_cube() {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1, 10);
  mesh.positions[0] += Vec3(1, 1, 1);
  return mesh;
}

/// Positions and channels of the limit at all vertices, by brute force.
std::vector<oracle::PointValue> brute_limits(const ControlMesh& mesh) {
  const oracle::BruteMesh brute = oracle::to_brute_mesh(mesh);
  const oracle::BruteTopology topology = oracle::build_topology(brute.cells, brute.vertex_count());
  std::vector<oracle::PointValue> limits;
  for (std::uint32_t v = 0; v < brute.vertex_count(); ++v) limits.push_back(oracle::limit_point(brute, topology, v));
  return limits;
}

std::size_t folding_cells(ControlMesh mesh) {
  mesh.allow_folds = true;
  return prepare_solid(mesh)->summary().folding_cells;
}

TEST(VertexFit, PassesThroughEveryVertexWithItsChannels) {
  std::size_t fits = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    try {
      const VertexFit fit(mesh);
      FitReport report;
      ControlMesh fitted = fit.fit_positions(FittedVertices::kAll, report);
      const double miss = fit.fit_channels(mesh, fitted).miss;
      EXPECT_TRUE(fitted.interpolating);
      EXPECT_EQ(report.missed, 0u);
      if (report.inside_missed > 0) continue;
      const auto limits = brute_limits(fitted);
      for (std::size_t v = 0; v < limits.size(); ++v) {
        ASSERT_LT((limits[v].head<3>() - mesh.positions[v]).norm(), 1e-6) << name << " vertex " << v;
        if (miss > 1e-9) continue;  // Singular: its channels are as near as can be.
        for (std::size_t c = 0; c < mesh.channel_count(); ++c) {
          ASSERT_NEAR(limits[v][static_cast<Eigen::Index>(3 + c)], mesh.channel_values[v * mesh.channel_count() + c],
                      1e-5)
              << name << " vertex " << v;
        }
      }
      ++fits;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kMeshNotInterpolable) << name << ": " << error.what();
    }
  }
  EXPECT_GT(2 * fits, oracle::tiny_meshes().size());
}

/// Compares the limit of each region, as a mesh of its own, with what is meant.
void expect_limits_of_regions(const ControlMesh& meant, const ControlMesh& fitted) {
  EXPECT_EQ(fitted.cell_regions, meant.cell_regions);
  for (int region = 0; region < static_cast<int>(meant.cell_region_names.size()); ++region) {
    const ControlMesh part = oracle::region_as_mesh(meant, region);
    const auto limits = brute_limits(oracle::region_as_mesh(fitted, region));
    ASSERT_EQ(limits.size(), part.vertex_count());
    for (std::size_t v = 0; v < limits.size(); ++v) {
      ASSERT_LT((limits[v].head<3>() - part.positions[v]).norm(), 1e-6) << "vertex " << v;
      for (std::size_t c = 0; c < part.channel_count(); ++c) {
        ASSERT_NEAR(limits[v][static_cast<Eigen::Index>(3 + c)], part.channel_values[v * part.channel_count() + c],
                    1e-4)
            << "vertex " << v;
      }
    }
  }
}

/// How many of these meshes are fitted in all vertices and channels.
std::size_t count_fits(const std::vector<oracle::RegionMesh>& meshes) {
  std::size_t fits = 0;
  for (const auto& [name, mesh] : meshes) {
    SCOPED_TRACE(name);
    for (const FittedVertices vertices : {FittedVertices::kAll, FittedVertices::kBoundary}) {
      try {
        const VertexFit fit(mesh);
        FitReport report;
        ControlMesh fitted = fit.fit_positions(vertices, report);
        const double miss = fit.fit_channels(mesh, fitted).miss;
        if (report.missed + report.inside_missed > 0 || miss > 1e-6) continue;
        expect_limits_of_regions(mesh, fitted);
        ++fits;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kMeshNotInterpolable) << error.what();
      }
    }
  }
  return fits;
}

// Each region is fitted as a mesh of its own would be.
TEST(VertexFit, PassesThroughTheVerticesOfEveryRegion) {
  EXPECT_GT(count_fits(oracle::region_meshes()), oracle::region_meshes().size() / 2);
}

TEST(VertexFit, FitsChannelsThatJumpInEveryRegion) {
  std::vector<oracle::RegionMesh> meshes = oracle::region_meshes();
  for (auto& [name, mesh] : meshes) {
    mesh = oracle::with_jumping_channels(mesh, {"a", "b"}, [](std::uint32_t vertex, std::uint8_t region) {
      const auto number = static_cast<float>(vertex % 17);
      return std::vector<float>{number + 30 * region, number * (region + 1)};
    });
  }
  EXPECT_GT(count_fits(meshes), meshes.size() / 2);
}

TEST(VertexFit, LeavesWhatTheLimitMeetsAlreadyAlone) {
  ControlMesh mesh = oracle::box_mesh(3, 2, 2);
  oracle::sharpen_by_cells(mesh, 1);
  FitReport report;
  const ControlMesh fitted = VertexFit(mesh).fit_positions(FittedVertices::kAll, report);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    EXPECT_LT((fitted.positions[v] - mesh.positions[v]).norm(), 1e-9) << v;
  }
  EXPECT_LT(report.swelling.offset.norm(), 1e-9);
}

TEST(VertexFit, MeansTheMeshThatItInterpolates) {
  const ControlMesh mesh = oracle::box_mesh(3, 3, 3, 2);
  FitReport report;
  const VertexFit fit(mesh);
  const ControlMesh fitted = fit.fit_positions(FittedVertices::kAll, report);
  const Deviation deviation = measure_limit(fitted).deviation;
  EXPECT_TRUE(deviation.interpolating);
  EXPECT_NEAR(deviation.control_volume_mm3, 216, 1e-8);
  EXPECT_LT((deviation.control_box.sizes() - Vec3(6, 6, 6)).norm(), 1e-9);
  EXPECT_EQ(deviation.farthest.distance_mm(), 0);
  EXPECT_TRUE(fitted.missed_vertices.empty());
  EXPECT_GT(deviation.limit_volume_mm3, 216) << "smooth, it swells between the corners";
  const ControlMesh meant = mesh_of_limit_points(fitted);
  EXPECT_FALSE(meant.interpolating);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    EXPECT_LT((meant.positions[v] - mesh.positions[v]).norm(), 1e-9) << v;
  }
}

TEST(VertexFit, SaysWhereTheLimitSwells) {
  const ControlMesh mesh = oracle::box_mesh(1, 1, 1, 10);
  FitReport report;
  VertexFit(mesh).fit_positions(FittedVertices::kAll, report);
  // The control cube is twice as large as the cube. The middle of a face of its limit has, of half its edge, the height
  // (16 + 4 * 4 * 3/4 + 4 * 5/9) / 36 = 0.84 above the middle; so it stands off the cube's face by 0.34 edges.
  EXPECT_EQ(report.swelling.much, 6u) << "all faces of the cube";
  ASSERT_EQ(report.swelling.vertices.size(), 4u);
  Vec3 middle = Vec3::Zero();
  for (const std::uint32_t v : report.swelling.vertices) middle += 0.25 * mesh.positions[v];
  EXPECT_NEAR((report.swelling.place - middle - report.swelling.offset).norm(), 0, 1e-9) << "it is above its face";
  EXPECT_NEAR(report.swelling.edges, 0.34, 0.01);
  EXPECT_NEAR(report.swelling.offset.norm(), 10 * report.swelling.edges, 1e-9);
  EXPECT_NEAR((report.swelling.place - Vec3(5, 5, 5)).norm(), 5 + report.swelling.offset.norm(), 1e-9);
}

TEST(VertexFit, RefusesToFoldWhatDidNotFold) {
  const ControlMesh mesh = uneven_box();
  ASSERT_EQ(folding_cells(mesh), 0u);
  FitReport report;
  expect_error([&] { VertexFit(mesh).fit_positions(FittedVertices::kAll, report); }, ErrorCode::kMeshNotInterpolable,
               "a limit through all vertices of the boundary would fold in cells");
}

/// Only inside are layers uneven: a limit through all vertices folds, one through those of the boundary doesn't.
TEST(VertexFit, LetsVerticesInsideGoBeforeItFolds) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4, 1);
  for (Vec3& p : mesh.positions) {
    const bool inside = (p.array() > 0.5).all() && (p.array() < 3.5).all();
    if (inside && std::lround(p.x()) == 2) p.x() = 1.02;
  }
  ASSERT_EQ(folding_cells(mesh), 0u);
  FitReport report;
  const ControlMesh fitted = VertexFit(mesh).fit_positions(FittedVertices::kAll, report);
  EXPECT_EQ(folding_cells(fitted), 0u);
  EXPECT_EQ(report.missed, 0u);
  EXPECT_GT(report.inside_missed, 0u);
  EXPECT_GT(report.inside_mm, 0);
}

TEST(VertexFit, OfTheBoundaryFoldsNothingAndSaysWhatStaysBehind) {
  const ControlMesh mesh = uneven_box();
  FitReport report;
  const ControlMesh fitted = VertexFit(mesh).fit_positions(FittedVertices::kBoundary, report);
  EXPECT_EQ(folding_cells(fitted), 0u);
  const auto limits = brute_limits(fitted);
  const CellComplex complex = make_cell_complex(mesh);
  std::vector<std::uint32_t> missed;
  double farthest = 0;
  for (const VertexId v : complex.vertices()) {
    if (!complex.vertex_on_boundary(v)) continue;
    const double distance = (limits[v].head<3>() - mesh.positions[v]).norm();
    if (distance > 1e-6) missed.push_back(v);
    farthest = std::max(farthest, distance);
  }
  EXPECT_EQ(report.missed, missed.size());
  EXPECT_GT(missed.size(), 0u);
  EXPECT_NEAR(report.farthest.distance_mm(), farthest, 1e-9);
  ASSERT_EQ(fitted.missed_vertices.size(), missed.size());
  for (std::size_t i = 0; i < missed.size(); ++i) {
    EXPECT_EQ(fitted.missed_vertices[i].vertex, missed[i]);
    EXPECT_EQ(fitted.missed_vertices[i].position, mesh.positions[missed[i]]);
  }
}

/// What was missed belongs to the mesh that is meant: the limit is compared with the box, whole as it came.
TEST(VertexFit, RemembersWhatItMissed) {
  FitReport report;
  const ControlMesh fitted = VertexFit(uneven_box()).fit_positions(FittedVertices::kBoundary, report);
  ASSERT_GT(report.missed, 0u);
  const Deviation deviation = measure_limit(fitted).deviation;
  EXPECT_EQ(deviation.farthest.position, uneven_box().positions[deviation.farthest.vertex]) << "one of several alike";
  EXPECT_NEAR(deviation.farthest.distance_mm(), report.farthest.distance_mm(), 1e-9);
  EXPECT_NEAR(deviation.control_volume_mm3, 27, 1e-5);
  EXPECT_LT((deviation.control_box.sizes() - Vec3(3, 3, 3)).norm(), 1e-6);
}

/// A box that would fold is prepared for each round, and once as it came.
TEST(VertexFit, TellsItsProgress) {
  std::vector<std::unique_ptr<PreparationProgress>> prepared;
  std::size_t sampled = 0;
  FitOptions options;
  options.progress.preparing = [&] { return prepared.emplace_back(std::make_unique<PreparationProgress>()).get(); };
  std::uint64_t reserved = 0;
  options.progress.reserve = [&](std::uint64_t bytes) { reserved = bytes; };
  options.progress.sampling = [&](std::size_t done, std::size_t) { sampled = done; };
  ControlMesh mesh = uneven_box();
  mesh.channel_names = {"a"};
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) mesh.channel_values.push_back(v % 2 ? 1.0f : 0.0f);
  const VertexFit fit(mesh, options);
  FitReport report;
  ControlMesh fitted = fit.fit_positions(FittedVertices::kBoundary, report);
  EXPECT_GE(prepared.size(), 3u);
  EXPECT_GT(reserved, 64u << 10) << "what the smallest mesh takes";
  for (const auto& progress : prepared) EXPECT_EQ(progress->state().step, PreparationStep::kFinishing);
  fit.fit_channels(mesh, fitted);
  EXPECT_EQ(sampled, mesh.cell_count());
}

TEST(VertexFit, ForgetsWhatAnotherFitMissed) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3, 2);
  mesh.interpolating = true;
  mesh.missed_vertices = {{0, Vec3(1, 2, 3)}, {5, Vec3(4, 5, 6)}};
  FitReport report;
  EXPECT_TRUE(VertexFit(mesh).fit_positions(FittedVertices::kAll, report).missed_vertices.empty());
  EXPECT_EQ(report.missed, 0u);
}

TEST(VertexFit, LeavesFoldsThatWereThere) {
  const ControlMesh mesh = oracle::folding_box_mesh();
  const std::size_t folds = folding_cells(mesh);
  ASSERT_GT(folds, 0u);
  ControlMesh allowed = mesh;
  allowed.allow_folds = true;
  FitReport report;
  EXPECT_NO_THROW(VertexFit(allowed).fit_positions(FittedVertices::kBoundary, report));
  EXPECT_EQ(report.missed, 0u);
}

TEST(VertexFit, NamesVerticesThatNoControlPointsReach) {
  FitReport report;
  expect_error([&] { VertexFit(dented_cube()).fit_positions(FittedVertices::kAll, report); },
               ErrorCode::kMeshNotInterpolable, "no control points take the limit through vertices 0, 1, 2, 3");
  VertexFit(dented_cube()).fit_positions(FittedVertices::kBoundary, report);
  EXPECT_EQ(report.missed, 8u);
  EXPECT_NEAR(report.farthest.distance_mm(), std::sqrt(3.0) / 8, 1e-6) << "an eighth of the dent at every corner";
}

TEST(VertexFit, SaysHowFarChannelsMiss) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  mesh.channel_names = {"a"};
  mesh.channel_values = {1, 0, 0, 0, 0, 0, 0, 0};
  const VertexFit fit(mesh);
  ControlMesh fitted = mesh;
  EXPECT_NEAR(fit.fit_channels(mesh, fitted).miss, 0.125, 1e-6);
  mesh.channel_values.assign(8, 3);
  EXPECT_EQ(fit.fit_channels(mesh, fitted).miss, 0);
  EXPECT_THAT(fitted.channel_values, testing::Each(3));
}

TEST(VertexFit, IsTheSameForAnyNumberOfThreads) {
  const ControlMesh mesh = uneven_box();
  FitReport report;
  const ControlMesh one = VertexFit(mesh, {.threads = 1}).fit_positions(FittedVertices::kBoundary, report);
  const ControlMesh two = VertexFit(mesh, {.threads = 2}).fit_positions(FittedVertices::kBoundary, report);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) EXPECT_EQ(one.positions[v], two.positions[v]);
}

TEST(VertexFit, TurnsMirroredCellsBeforeItFits) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  std::swap_ranges(mesh.cell_vertices.begin(), mesh.cell_vertices.begin() + 4, mesh.cell_vertices.begin() + 4);
  FitReport report;
  const ControlMesh fitted = VertexFit(mesh).fit_positions(FittedVertices::kAll, report);
  EXPECT_EQ(fitted.cell_vertices, oracle::box_mesh(2, 2, 2).cell_vertices);
}

TEST(VertexFit, RefusesWhatIsNoSolidAndStopsWhenCancelled) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  mesh.cell_vertices.front() = mesh.cell_vertices[1];
  expect_error([&] { VertexFit fit(mesh); }, ErrorCode::kMeshRepeatedVertex, "repeated");
  const auto token = CancellationToken::make();
  token.cancel();
  expect_error([&] { VertexFit fit(oracle::box_mesh(8, 8, 8), {.cancel = token}); }, ErrorCode::kCancelled, "cancel");
}

}  // namespace
}  // namespace ccslice
