// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/limit_masks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/mesh/validate.h"
#include "tests/support/brute_force.h"
#include "tests/support/random_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

Vec3 limit_of(const Stencils& masks, std::uint32_t row, const std::vector<Vec3>& points) {
  Vec3 limit;
  masks.apply(row, 1, points.front().data(), 3, limit.data());
  return limit;
}

/// Against brute force, which refines until nothing changes.
void expect_limits(const ControlMesh& mesh, const std::string& name) {
  const oracle::BruteMesh brute = oracle::to_brute_mesh(mesh);
  const oracle::BruteTopology topology = oracle::build_topology(brute.cells, brute.vertex_count());
  const CellComplex complex = make_cell_complex(mesh);
  const Stencils masks = limit_masks(complex);
  ASSERT_EQ(masks.rows(), mesh.vertex_count()) << name;
  for (std::uint32_t v = 0; v < masks.rows(); ++v) {
    const Vec3 expected = oracle::limit_point(brute, topology, v).head<3>();
    EXPECT_LT((limit_of(masks, v, mesh.positions) - expected).norm(), 1e-12) << name << " vertex " << v;
  }
}

TEST(LimitMasks, GiveTheLimitsOfTheCatalogue) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) expect_limits(mesh, name);
}

TEST(LimitMasks, GiveTheLimitsOfRandomMeshes) {
  constexpr std::uint32_t kSeeds = 12;
  int valid = 0;
  for (const auto kind : {oracle::RandomKind::kPolycube, oracle::RandomKind::kHexStar, oracle::RandomKind::kTetStar,
                          oracle::RandomKind::kTerrain}) {
    for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
      ControlMesh mesh = oracle::random_mesh(kind, seed);
      mesh.allow_folds = true;
      try {
        validate(mesh);
      } catch (const Error&) {
        continue;
      }
      ++valid;
      expect_limits(mesh, "kind " + std::to_string(static_cast<int>(kind)) + " seed " + std::to_string(seed));
    }
  }
  EXPECT_GT(valid, 24);
}

TEST(BoundaryFaceMasks, GiveTheLimitsOfTheCatalogue) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const oracle::BruteMesh brute = oracle::to_brute_mesh(mesh);
    const oracle::BruteTopology coarse = oracle::build_topology(brute.cells, brute.vertex_count());
    const oracle::BruteMesh fine = oracle::refine(brute, coarse).mesh;
    const oracle::BruteTopology topology = oracle::build_topology(fine.cells, fine.vertex_count());
    const CellComplex complex = make_cell_complex(mesh);
    const std::vector<Vec3> limits = boundary_face_masks(complex).apply(mesh.positions);
    // A face's middle is known by its corners' mean, which is its point one refinement on.
    std::size_t row = 0;
    for (const FaceId f : complex.faces()) {
      if (!complex.face_on_boundary(f)) continue;
      Vec3 mean = Vec3::Zero();
      const auto ring = complex.face_vertices(f);
      for (const VertexId v : ring) mean += mesh.positions[v] / static_cast<double>(ring.size());
      std::uint32_t nearest = 0;
      for (std::uint32_t v = 0; v < fine.vertex_count(); ++v) {
        if ((fine.position(v) - mean).norm() < (fine.position(nearest) - mean).norm()) nearest = v;
      }
      ASSERT_LT((fine.position(nearest) - mean).norm(), 1e-12) << name;
      const Vec3 expected = oracle::limit_point(fine, topology, nearest).head<3>();
      EXPECT_LT((limits[row++] - expected).norm(), 1e-12) << name << " face " << f;
    }
    EXPECT_EQ(row, limits.size()) << name;
  }
}

TEST(LimitMasks, OfTheBoundaryTakeNothingFromInside) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  const Stencils masks = limit_masks(complex);
  for (const VertexId v : complex.vertices()) {
    if (!complex.vertex_on_boundary(v)) continue;
    for (std::uint32_t e = masks.offsets[v]; e < masks.offsets[v + 1]; ++e) {
      EXPECT_TRUE(complex.vertex_on_boundary(VertexId{masks.indices[e]})) << v;
    }
  }
}

TEST(LimitMasks, OfARegularVertexIsThreeTimesTheCubicSplines) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(2, 2, 2));
  const Stencils masks = limit_masks(complex);
  for (const VertexId v : complex.vertices()) {
    if (complex.vertex_on_boundary(v)) continue;
    const auto weights = std::span(masks.weights).subspan(masks.offsets[v], masks.offsets[v + 1] - masks.offsets[v]);
    ASSERT_EQ(weights.size(), 27u);
    EXPECT_NEAR(std::ranges::max(weights), 64.0 / 216, 1e-15);
    EXPECT_NEAR(std::ranges::min(weights), 1.0 / 216, 1e-15);
  }
}

TEST(LimitMasks, StopWhenCancelled) {
  const auto token = CancellationToken::make();
  token.cancel();
  const CellComplex complex = make_cell_complex(oracle::box_mesh(8, 8, 8));
  EXPECT_THROW(limit_masks(complex, token), Error);
}

}  // namespace
}  // namespace ccslice
