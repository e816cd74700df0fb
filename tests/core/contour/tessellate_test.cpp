// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/tessellate.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/allocation_count.h"
#include "tests/support/bfr_surface.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

ErrorCode error_of(const LimitSolid& solid, const TessellationOptions& options) {
  try {
    triangulate(solid, Placement::Identity(), options);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::kInternal;
}

TEST(Tessellate, ASharpBoxTakesTwoTrianglesAFace) {
  const auto box = prepare_solid(make_box());
  const Triangulation triangles = triangulate(*box, Placement::Identity(), {});
  EXPECT_EQ(triangles.summary.triangles, 2u * 2u * (6u * 4u + 6u * 2u + 4u * 2u));
  EXPECT_EQ(unmatched_edges(triangles.all), 0u);
  EXPECT_NEAR(signed_volume(triangles.all), 24 * 16 * 8, 1e-9);
}

TEST(Tessellate, MirroredPlacementsStayOutward) {
  const auto solid = prepare_solid(oracle::tiny_mesh("edge_valence_5_inside"));
  Placement mirrored = Placement::Identity();
  mirrored.linear()(1, 1) = -1;
  const double volume = signed_volume(triangulate(*solid, Placement::Identity(), {}).all);
  EXPECT_GT(volume, 0);
  EXPECT_NEAR(signed_volume(triangulate(*solid, mirrored, {}).all), volume, 1e-9 * volume);
}

TEST(Tessellate, VerticesLieOnTheLimitWithItsChannels) {
  ControlMesh mesh = oracle::tiny_mesh("cross_of_seven");
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  oracle::grade_by_coordinates(mesh);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  const TessellationChunk all = triangulate(*solid, Placement::Identity(), {}).all;
  ASSERT_EQ(all.channel_values.size(), 3 * all.positions.size());
  for (std::size_t v = 0; v < all.positions.size(); ++v) {
    EXPECT_LT((evaluator.geo(all.at[v]) - all.positions[v]).norm(), 1e-9);
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(all.channel_values[3 * v + d], all.positions[v][d], 1e-5);
  }
}

TEST(Tessellate, TrianglesLieWithinTheToleranceOfOpenSubdivsSurface) {
  for (const char* name : {"single_hex", "vertex_link_icosahedron", "concave_corner", "sharp_cross"}) {
    const ControlMesh& control = oracle::tiny_mesh(name);
    const oracle::BruteMesh mesh = oracle::to_brute_mesh(control);
    const oracle::BfrSurface surface(mesh, oracle::build_topology(mesh.cells, mesh.vertex_count()));
    const oracle::NearestOnSurface nearest(surface, 16);
    const TessellationChunk all =
        triangulate(*prepare_solid(control), Placement::Identity(), {.tolerance_mm = 0.05}).all;
    double worst = 0;
    for (std::size_t k = 0; k < all.triangles.size(); k += 7) {
      const auto& [a, b, c] = all.triangles[k];
      worst = std::max(worst, nearest.distance((all.positions[a] + all.positions[b] + all.positions[c]) / 3));
    }
    EXPECT_LE(worst, 0.05) << name;
  }
}

TEST(Tessellate, ChunksHoldWhatWasAskedFor) {
  const auto solid = prepare_solid(oracle::tiny_mesh("box_2"));
  const Triangulation whole = triangulate(*solid, Placement::Identity(), {.chunk_triangles = 1u << 30});
  const Triangulation pieces = triangulate(*solid, Placement::Identity(), {.chunk_triangles = 100});
  EXPECT_EQ(whole.chunks, 1u);
  EXPECT_GT(pieces.chunks, whole.summary.triangles / 200);
  EXPECT_EQ(pieces.all.triangles, whole.all.triangles);
  EXPECT_EQ(pieces.all.positions, whole.all.positions);
  EXPECT_EQ(pieces.all.channel_values, whole.all.channel_values);
}

/// Bounded before, counted while it is made, and compared with what is delivered and held.
void expect_bounds(const std::string& what, const LimitSolid& solid, double tolerance_mm) {
  const TessellationOptions options{.tolerance_mm = tolerance_mm};
  const TessellationBound bound = bound_tessellation(solid, Placement::Identity(), options);
  const oracle::HeldMemory held;
  TessellationSummary whole;
  std::size_t delivered = 0;
  const TessellationSummary all =
      tessellate(solid, Placement::Identity(), options, bound, [&](const TessellationChunk& chunk) {
        whole = chunk.whole;
        delivered += chunk.triangles.size();
      });
  EXPECT_LE(held.most_bytes(), bound.scratch_bytes) << what;
  EXPECT_EQ(whole.vertices, all.vertices) << what;
  EXPECT_EQ(whole.triangles, all.triangles) << what;
  EXPECT_EQ(delivered, all.triangles) << what;
  EXPECT_LE(all.vertices, bound.most.vertices) << what;
  EXPECT_LE(all.triangles, bound.most.triangles) << what;
  EXPECT_GE(all.triangles, 2 * bound.leaves) << what;
}

TEST(Tessellate, IsBoundedBeforeItIsMade) {
  for (const SampleModel& model : sample_models()) {
    const auto solid = prepare_solid(model.make());
    for (const double tolerance_mm : {1.0, 0.1}) expect_bounds(std::string(model.name), *solid, tolerance_mm);
  }
  for (const char* name : {"single_hex", "concave_corner", "sharp_cross", "vertex_link_icosahedron"}) {
    const auto solid = prepare_solid(oracle::tiny_mesh(name));
    for (const double tolerance_mm : {100.0, 0.1, 1e-3}) expect_bounds(name, *solid, tolerance_mm);
  }
}

/// Leaves have no more triangles than chunks, and the same volume but for the tolerance.
TEST(Tessellate, LeavesAreVisitedWithTheirCorners) {
  const auto solid = prepare_solid(oracle::tiny_mesh("edge_valence_5_inside"));
  TessellationOptions options;
  options.tolerance_mm = 0.01;
  const BoundarySurface surface(*solid);
  double volume = 0;
  std::uint64_t leaves = 0;
  const auto cone = [](const Vec3& a, const Vec3& b, const Vec3& c) { return a.dot(b.cross(c)) / 6; };
  visit_leaves(*solid, Placement::Identity(), options, surface.face_ids(), [&](const std::array<Vec3, 4>& corners) {
    volume += cone(corners[0], corners[1], corners[2]) + cone(corners[0], corners[2], corners[3]);
    ++leaves;
  });
  const double closed = signed_volume(triangulate(*solid, Placement::Identity(), options).all);
  EXPECT_NEAR(volume, closed, 0.01 * closed);
  EXPECT_EQ(leaves, bound_tessellation(*solid, Placement::Identity(), options).leaves);
  options.tolerance_mm = -1;
  EXPECT_THROW(visit_leaves(*solid, Placement::Identity(), options, surface.face_ids(), [](const auto&) {}), Error);
}

TEST(Tessellate, RefusesTolerancesThatMakeNoSense) {
  const auto solid = prepare_solid(oracle::tiny_mesh("box_2"));
  for (const double tolerance_mm :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(error_of(*solid, {.tolerance_mm = tolerance_mm}), ErrorCode::kToleranceInvalid);
  }
  EXPECT_EQ(error_of(*solid, {.tolerance_mm = 1e-3, .max_triangles = 100}), ErrorCode::kTooManyTriangles);
  TessellationOptions cancelled;
  cancelled.cancel = CancellationToken::make();
  cancelled.cancel.cancel();
  EXPECT_EQ(error_of(*solid, cancelled), ErrorCode::kCancelled);
}

}  // namespace
}  // namespace ccslice
