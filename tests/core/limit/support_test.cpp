// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;

std::vector<Vec3> random_directions(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  std::vector<Vec3> directions;
  for (int k = 0; k < count; ++k)
    directions.push_back(Vec3(normal(random), normal(random), normal(random)).normalized());
  return directions;
}

TEST(Support, OfABoxIsThatOfItsCorners) {
  ControlMesh mesh = oracle::box_mesh(3, 2, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  std::mt19937 random(kSeed);
  std::vector<Vec3> directions = random_directions(random, 20);
  directions.insert(directions.end(), {Vec3::UnitX(), -Vec3::UnitZ(), Vec3::Zero(), Vec3(100, 0, 1)});
  const std::vector<double> supports = support(BoundarySurface(*solid), directions);
  ASSERT_EQ(supports.size(), directions.size());
  for (std::size_t k = 0; k < directions.size(); ++k) {
    const double expected = directions[k].cwiseMax(0).dot(Vec3(30, 20, 10));
    EXPECT_NEAR(supports[k], expected, 1e-9 * (1 + expected));
  }
}

// The largest sample is less, by no more than the surface bends between samples.
TEST(Support, IsThatOfDenseSamples) {
  constexpr int kSteps = 48;
  std::mt19937 random(kSeed);
  for (const char* name : {"box_3", "cross_of_seven", "vertex_link_icosahedron", "edge_valence_3_meets_corner",
                           "sharp_hex_wedge_tet", "concave_corner"}) {
    const auto solid = prepare_solid(oracle::tiny_mesh(name));
    const BoundarySurface surface(*solid);
    LimitEvaluator evaluator(*solid);
    const std::vector<Vec3> directions = random_directions(random, 12);
    std::vector<double> largest(directions.size(), -std::numeric_limits<double>::infinity());
    for (const BoundaryFaceId face : surface.face_ids()) {
      for (int k = 0; k < (kSteps + 1) * (kSteps + 1); ++k) {
        const double s = k % (kSteps + 1) / double{kSteps}, t = k / (kSteps + 1) / double{kSteps};
        const Vec3 point = evaluator.geo(surface.cell_param(face, s, t));
        for (std::size_t d = 0; d < directions.size(); ++d) largest[d] = std::max(largest[d], directions[d].dot(point));
      }
    }
    const std::vector<double> supports = support(surface, directions);
    for (std::size_t d = 0; d < directions.size(); ++d) {
      EXPECT_GE(supports[d], largest[d] - 1e-8) << name << ", seed " << kSeed;
      EXPECT_LE(supports[d], largest[d] + 5e-3) << name << ", seed " << kSeed;
      EXPECT_EQ(support(surface, std::array{directions[d]})[0], supports[d]);
    }
  }
}

TEST(Support, CanBeCancelled) {
  const auto solid = prepare_solid(oracle::tiny_mesh("box_3"));
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW(support(BoundarySurface(*solid), std::array{Vec3(Vec3::UnitX())}, cancel), Error);
}

}  // namespace
}  // namespace ccslice
