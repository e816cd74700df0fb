// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/side_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/surface_points.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSideSeed = 20261123;
constexpr double kSolverRounding = 1e-9;  // mm.

class SideSolverTest : public testing::TestWithParam<const char*> {
 protected:
  SideSolverTest()
      : points_(oracle::tiny_mesh(GetParam()), kSideSeed), leaves_(points_.surface), solver_(points_.surface) {
    faces_ = points_.surface.face_ids().to_vector();
  }

  /// The leaves of a layer.
  void start(double height_mm) {
    height_mm_ = height_mm;
    leaves_.collect(faces_, {points_.axes, height_mm, 1e-11, 0.01, 0.1, {}});
    solver_.start(points_.axes, height_mm);
  }

  /// Heights of layers: some anywhere, some just beside irregular vertices.
  std::vector<double> layers() {
    std::mt19937 random(kSideSeed);
    const auto [low, high] = points_.heights();
    std::vector<double> result;
    for (int k = 0; k < 8; ++k) result.push_back(std::uniform_real_distribution<double>(low, high)(random));
    for (const BoundaryFaceId face : faces_) {
      if (points_.surface.faces()[face].regular) continue;
      const double vertex = points_.height(face, 0, 0);
      result.insert(result.end(), {vertex + 1e-6, vertex - 1e-4});
      if (result.size() > 20) break;
    }
    return result;
  }

  SurfacePoints points_;
  ContourLeaves leaves_;
  SideSolver solver_;
  std::vector<BoundaryFaceId> faces_;
  double height_mm_ = 0;
};

TEST_P(SideSolverTest, HeightsAreThoseOfTheSurface) {
  std::size_t remainders = 0;
  for (const double layer : layers()) {
    start(layer);
    for (const ContourLeaf& id : leaves_.leaves()) {
      const LeafSurface leaf = leaves_.surface(id);
      const SurfaceBox& box = leaf.node.box;
      remainders += leaf.node.remainder;
      for (int side = 0; side < 4; ++side) {
        for (const std::uint32_t eighth : {0u, 1u, 4u, 7u, 8u}) {
          const auto [s0, t0] = box.corner(side == 0 || side == 3 ? 0 : side == 1 ? 1 : 3);  // The lower end.
          const std::uint32_t along = static_cast<std::uint32_t>(std::uint64_t{box.size} * eighth / 8);
          const std::uint32_t s = s0 + (side % 2 == 0 ? along : 0), t = t0 + (side % 2 == 0 ? 0 : along);
          const double expected = points_.at_vertex(box.face, s, t).z() - layer;
          ASSERT_NEAR(solver_.height(leaf, side, s, t), expected, kSolverRounding)
              << "side " << side << ", eighth " << eighth;
        }
      }
    }
  }
  const auto faces = points_.surface.faces();
  const bool irregular =
      std::any_of(faces.begin(), faces.end(), [](const BoundaryFace& face) { return !face.regular; });
  EXPECT_EQ(remainders > 0, irregular);
}

TEST_P(SideSolverTest, CrossingsLieOnTheirSideOnTheSurfaceAndInThePlane) {
  std::size_t crossings = 0, of_remainders = 0;
  for (const double layer : layers()) {
    start(layer);
    for (const ContourLeaf& id : leaves_.leaves()) {
      const LeafSurface leaf = leaves_.surface(id);
      leaves_.walk_rim(id, [&](int side, const RimVertex& from, const RimVertex& to) {
        const SideEnd begin{from.s, from.t, side_of(solver_.height(leaf, side, from.s, from.t))};
        const SideEnd end{to.s, to.t, side_of(solver_.height(leaf, side, to.s, to.t))};
        if (begin.side == end.side) return;
        ++crossings;
        of_remainders += leaf.node.remainder && (side == 0 || side == 3);
        const SidePoint found = solver_.crossing(leaf, side, begin, end);
        const auto is_between = [](double at, std::uint32_t a, std::uint32_t b) {
          return at * kSurfaceOne >= std::min(a, b) && at * kSurfaceOne <= std::max(a, b);
        };
        EXPECT_TRUE(is_between(found.s, from.s, to.s) && is_between(found.t, from.t, to.t));
        const Vec3 point = points_.at(leaf.node.box.face, found.s, found.t);
        EXPECT_NEAR(point.z(), layer, kSolverRounding);
        EXPECT_LT((point.head<2>() - found.xy).norm(), kSolverRounding);
        const SidePoint backwards = solver_.crossing(leaf, side, end, begin);
        EXPECT_EQ(backwards.s, found.s);
        EXPECT_EQ(backwards.t, found.t);
        EXPECT_EQ(backwards.xy, found.xy);
      });
    }
  }
  EXPECT_GT(crossings, 100u);
  const auto faces = points_.surface.faces();
  const bool irregular =
      std::any_of(faces.begin(), faces.end(), [](const BoundaryFace& face) { return !face.regular; });
  EXPECT_EQ(of_remainders > 0, irregular);
}

INSTANTIATE_TEST_SUITE_P(Meshes, SideSolverTest, testing::ValuesIn(kSurfaceMeshes),
                         [](const auto& info) { return std::string(info.param); });

/// A leaf of its own, with these heights along side 0; x runs along it from 0 to 3.
struct SingleLeaf {
  SurfaceNode node;
  BezierNet net;

  explicit SingleLeaf(const std::array<double, 4>& z) {
    for (int k = 0; k < 16; ++k) {
      net.x[k] = k % 4;
      net.y[k] = k / 4;
      net.z[k] = z[static_cast<std::size_t>(k % 4)];
    }
  }
};

class CrossingOfACubic : public testing::Test {
 protected:
  CrossingOfACubic() : solid_(prepare_solid(oracle::tiny_mesh("box_3"))), surface_(*solid_), solver_(surface_) {
    solver_.start({}, 0);
  }
  double of(const std::array<double, 4>& z, PlaneSide from, PlaneSide to) {
    const SingleLeaf leaf(z);
    const SidePoint found = solver_.crossing({leaf.node, leaf.net}, 0, {0, 0, from}, {kSurfaceOne, 0, to});
    EXPECT_NEAR(found.xy.x(), 3 * found.s, 1e-14);
    return found.s;
  }

  std::shared_ptr<const LimitSolid> solid_;
  BoundarySurface surface_;
  SideSolver solver_;
};

TEST_F(CrossingOfACubic, IsItsRoot) {
  EXPECT_NEAR(of({-1, -1.0 / 3, 1.0 / 3, 1}, PlaneSide::kBelow, PlaneSide::kAbove), 0.5, 1e-15);
  EXPECT_NEAR(of({1, 0, -1, -2}, PlaneSide::kAbove, PlaneSide::kBelow), 1.0 / 3, 1e-15);
  // (2 s - 1)^3 is flat at its root, s^3 - 1/1000 nearly.
  EXPECT_NEAR(of({-1, 1, -1, 1}, PlaneSide::kBelow, PlaneSide::kAbove), 0.5, 1e-5);
  EXPECT_NEAR(of({-1e-3, -1e-3, -1e-3, 0.999}, PlaneSide::kBelow, PlaneSide::kAbove), 0.1, 1e-12);
}

// As decided elsewhere, within rounding.
TEST_F(CrossingOfACubic, IsTheEndNearerThePlaneWhereRoundingLeavesNone) {
  EXPECT_EQ(of({1e-16, 1, 1, 1}, PlaneSide::kBelow, PlaneSide::kAbove), 0);
  EXPECT_EQ(of({-1, -1, -1, -1e-16}, PlaneSide::kBelow, PlaneSide::kAbove), 1);
}

}  // namespace
}  // namespace ccslice
