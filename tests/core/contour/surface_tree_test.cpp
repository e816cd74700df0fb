// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/surface_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <vector>

#include "tests/core/contour/surface_points.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;
constexpr double kRounding = 1e-9;  // mm.

/// A tree of a mesh, and nodes on the way down to random places of its faces.
class SurfaceTreeTest : public testing::TestWithParam<const char*> {
 protected:
  SurfaceTreeTest() : points_(oracle::tiny_mesh(GetParam()), kSeed), tree_(points_.surface), random_(kSeed) {
    EXPECT_TRUE(tree_.start(points_.axes, 0));
  }

  double share() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  /// Calls visit(id) for the nodes that hold a random place of each face, down to a depth.
  void descend(int depth, const std::function<void(std::uint32_t)>& visit) {
    for (const BoundaryFaceId face : points_.surface.face_ids()) {
      const double s = trials_++ % 3 == 0 ? 1e-3 * share() : share(), t = s < 1e-3 ? 1e-3 * share() : share();
      std::uint32_t id = tree_.root(face);
      for (int level = 0;; ++level) {
        visit(id);
        if (level == depth) break;
        const SurfaceBox box = tree_.node(id).box;
        const std::uint32_t half = box.size / 2;
        const int right = s * kSurfaceOne >= box.s + half, upper = t * kSurfaceOne >= box.t + half;
        id = tree_.children(id) + static_cast<std::uint32_t>(right + 2 * upper);
      }
    }
  }

  /// In the box of a node, at shares of it.
  Vec3 at(const SurfaceBox& box, double u, double v) {
    return points_.at(box.face, (box.s + u * box.size) / kSurfaceOne, (box.t + v * box.size) / kSurfaceOne);
  }

  SurfacePoints points_;
  SurfaceTree tree_;
  std::mt19937 random_;
  int trials_ = 0;
};

TEST_P(SurfaceTreeTest, HullsHoldTheSurface) {
  std::size_t remainders = 0, regular = 0;
  descend(8, [&](std::uint32_t id) {
    const double low = tree_.node(id).low, high = tree_.node(id).high;
    for (int k = 0; k < 10; ++k) {
      const double z = at(tree_.node(id).box, share(), share()).z();
      ASSERT_GE(z, low - kRounding) << "seed " << kSeed;
      ASSERT_LE(z, high + kRounding) << "seed " << kSeed;
    }
    tree_.children(id);  // Narrows those of remainders.
    EXPECT_GE(tree_.node(id).low, low);
    EXPECT_LE(tree_.node(id).high, high);
    for (int k = 0; k < 10; ++k) {
      const double z = at(tree_.node(id).box, share(), share()).z();
      ASSERT_GE(z, tree_.node(id).low - kRounding) << "seed " << kSeed;
      ASSERT_LE(z, tree_.node(id).high + kRounding) << "seed " << kSeed;
    }
    ++(tree_.node(id).remainder ? remainders : regular);
  });
  EXPECT_GT(regular, 100u);
  const auto& faces = points_.surface.faces();
  const bool irregular =
      std::any_of(faces.begin(), faces.end(), [](const BoundaryFace& face) { return !face.regular; });
  EXPECT_EQ(remainders > 0, irregular);
}

TEST_P(SurfaceTreeTest, HullsShrinkTowardsTheSurface) {
  double first = 0, last = 0;
  descend(6, [&](std::uint32_t id) {
    const SurfaceNode& node = tree_.node(id);
    if (node.box.size == kSurfaceOne) first += node.high - node.low;
    if (node.box.size == kSurfaceOne >> 6) last += node.high - node.low;
  });
  EXPECT_LT(last, first / 32);
}

TEST_P(SurfaceTreeTest, NetsAreTheSurface) {
  const auto bernstein = [](double u) {
    const double v = 1 - u;
    return std::array{v * v * v, 3 * v * v * u, 3 * v * u * u, u * u * u};
  };
  descend(5, [&](std::uint32_t id) {
    if (tree_.node(id).remainder) return;
    const BezierNet& net = tree_.net(id);
    for (int n = 0; n < 5; ++n) {
      const double u = share(), v = share();
      Vec3 point = Vec3::Zero();
      for (int k = 0; k < 16; ++k)
        point += bernstein(u)[k % 4] * bernstein(v)[k / 4] * Vec3(net.x[k], net.y[k], net.z[k]);
      ASSERT_LT((point - at(tree_.node(id).box, u, v)).norm(), kRounding);
    }
  });
}

/// Largest distance of points of a line in a box from the chord between its ends.
TEST_P(SurfaceTreeTest, ChordsAndDiagonalsAreBounded) {
  descend(5, [&](std::uint32_t id) {
    const SurfaceNode node = tree_.examine(id);
    const double u0 = share(), v0 = share(), u1 = share(), v1 = share();
    const Vec3 p = at(node.box, u0, v0), q = at(node.box, u1, v1);
    const double length = node.remainder ? (q - p).norm() : (q - p).head<2>().norm();
    EXPECT_LE(length, node.diagonal + kRounding);
    if (node.remainder) return;
    for (const double w : {0.2, 0.5, 0.7}) {
      const Vec3 on_surface = at(node.box, u0 + w * (u1 - u0), v0 + w * (v1 - v0));
      EXPECT_LE((on_surface - (p + w * (q - p))).norm(), node.chord.along(u1 - u0, v1 - v0) + kRounding);
      EXPECT_LE((on_surface - (p + w * (q - p))).norm(), node.chord.whole() + kRounding);
    }
  });
}

TEST_P(SurfaceTreeTest, HeightsRunAlongSidesAndAcrossLevelLinesAsTheyAreSaidTo) {
  std::map<LevelLines, int> kinds;
  int monotone = 0;
  descend(5, [&](std::uint32_t id) {
    const SurfaceNode node = tree_.examine(id);
    if (node.remainder) return;
    ++kinds[node.level_lines];
    const auto z = [&](double u, double v) { return at(node.box, u, v).z(); };
    for (int side = 0; side < 4; ++side) {
      if (!(node.monotone_sides >> side & 1)) continue;
      ++monotone;
      const double across = side == 1 || side == 2 ? 1 : 0;
      const auto along = [&](double w) { return side % 2 == 0 ? z(w, across) : z(across, w); };
      const double rise = along(1) - along(0) > 0 ? 1 : -1;
      const double w0 = share(), w1 = w0 + (1 - w0) * share();
      EXPECT_GE(rise * (along(w1) - along(w0)), -kRounding) << "side " << side;
    }
    const bool across_s = node.level_lines == LevelLines::kAcrossS || node.level_lines == LevelLines::kAcrossST;
    const bool across_t = node.level_lines == LevelLines::kAcrossT || node.level_lines == LevelLines::kAcrossST;
    const double u = share(), v = share(), w = u + (1 - u) * share(), x = v + (1 - v) * share();
    if (across_s) {
      EXPECT_GE((z(w, v) - z(u, v)) * (z(1, 0) - z(0, 0) > 0 ? 1 : -1), -kRounding);
    }
    if (across_t) {
      EXPECT_GE((z(u, x) - z(u, v)) * (z(0, 1) - z(0, 0) > 0 ? 1 : -1), -kRounding);
    }
    if (node.level_lines == LevelLines::kOpen) {
      constexpr double kStep = 1e-4;
      const double a = z(0.5 + kStep, 0.5) - z(0.5 - kStep, 0.5), b = z(0.5, 0.5 + kStep) - z(0.5, 0.5 - kStep);
      const double most = std::max(std::abs(a), std::abs(b));
      const double u0 = 0.5 * share(), v0 = 0.5 * share(), step = 0.5 * share() / most;
      const double begin_u = a > 0 ? u0 : 1 - u0, begin_v = b > 0 ? v0 : 1 - v0;
      EXPECT_GE(z(begin_u + step * a, begin_v + step * b) - z(begin_u, begin_v), -kRounding);
    }
  });
  EXPECT_GT(monotone, 100);
  EXPECT_GT(kinds[LevelLines::kAcrossST], kinds[LevelLines::kUnknown]);
}

TEST_P(SurfaceTreeTest, VerticesOfAllNodesAreTheSameWhereTheyMeet) {
  std::map<std::uint32_t, Vec3> places;
  const auto expect_at = [&](std::uint32_t vertex, const Vec3& place) {
    EXPECT_LT((places.try_emplace(vertex, place).first->second - place).norm(), 1e-8) << vertex;
  };
  descend(3, [&](std::uint32_t id) {
    const SurfaceNode node = tree_.examine(id);
    const std::array<std::uint32_t, 8> quarters = tree_.quarters(id);
    EXPECT_EQ(tree_.quarters(id), quarters);
    for (int k = 0; k < 4; ++k) {
      const auto [s0, t0] = node.box.corner(k);
      const auto [s1, t1] = node.box.corner((k + 1) % 4);
      const auto between = [&](double w) {
        return points_.at(node.box.face, ((1 - w) * s0 + w * s1) / kSurfaceOne, ((1 - w) * t0 + w * t1) / kSurfaceOne);
      };
      expect_at(node.corners[k], between(0));
      expect_at(node.middles[k], between(0.5));
      expect_at(quarters[2 * k], between(0.25));
      expect_at(quarters[2 * k + 1], between(0.75));
    }
  });
  EXPECT_GT(places.size(), 100u);
  std::vector<Vec3> sorted;
  for (const auto& [vertex, place] : places) sorted.push_back(place);
  std::sort(sorted.begin(), sorted.end(), [](const Vec3& a, const Vec3& b) { return a.x() < b.x(); });
  for (std::size_t k = 1; k < sorted.size(); ++k) EXPECT_GT((sorted[k] - sorted[k - 1]).norm(), 1e-6);
}

TEST_P(SurfaceTreeTest, StandInsMeetTheirSiblingsAndTheIrregularVertex) {
  for (const BoundaryFaceId face : points_.surface.face_ids()) {
    std::uint32_t id = tree_.root(face);
    if (!tree_.node(id).remainder) continue;
    for (int level = 1; level <= 10; ++level) {
      id = tree_.children(id);
      ASSERT_TRUE(tree_.node(id).remainder);
      EXPECT_FALSE(tree_.node(id + 1).remainder || tree_.node(id + 2).remainder || tree_.node(id + 3).remainder);
      tree_.stand_in(id);
      const BezierNet& net = tree_.net(id);
      EXPECT_EQ(side_curve(net, 1).z, side_curve(tree_.net(id + 1), 3).z);
      EXPECT_EQ(side_curve(net, 1).x, side_curve(tree_.net(id + 1), 3).x);
      EXPECT_EQ(side_curve(net, 2).y, side_curve(tree_.net(id + 2), 0).y);
      EXPECT_LT((Vec3(net.x[0], net.y[0], net.z[0]) - points_.at(face, 0, 0)).norm(), kRounding);
      for (int k = 1; k < 4; ++k) {  // Straight from there to its siblings.
        EXPECT_NEAR(net.z[k], net.z[0] + k / 3.0 * (net.z[3] - net.z[0]), kRounding);
        EXPECT_NEAR(net.z[4 * k], net.z[0] + k / 3.0 * (net.z[12] - net.z[0]), kRounding);
      }
    }
  }
}

TEST_P(SurfaceTreeTest, NodesAreKeptForTheSameAxesWithinBounds) {
  EXPECT_FALSE(tree_.start(points_.axes, 0));
  const std::uint32_t root = tree_.root(BoundaryFaceId{1});
  tree_.children(root);
  const double low = tree_.node(root).low;
  EXPECT_FALSE(tree_.start(points_.axes, 0));
  EXPECT_EQ(tree_.root(BoundaryFaceId{1}), root);
  AffineMap other = points_.axes;
  other.offset.z() += 1;
  EXPECT_TRUE(tree_.start(other, 0));
  EXPECT_EQ(tree_.vertices().size(), 0u);
  const std::uint32_t moved = tree_.root(BoundaryFaceId{1});
  tree_.children(moved);
  EXPECT_NEAR(tree_.node(moved).low, low + 1, kRounding);
  // The root, and four nodes for each that is halved.
  std::vector<std::uint32_t> ids{moved};
  std::size_t next = 0;
  const auto halve_next = [&] {
    const std::uint32_t first = tree_.children(ids[next++]);
    for (std::uint32_t child = first; child < first + 4; ++child) ids.push_back(child);
  };
  while (ids.size() + 4 <= SurfaceTree::kKeptNodes) halve_next();
  EXPECT_FALSE(tree_.start(other, 0));
  halve_next();
  EXPECT_FALSE(tree_.start(other, ids.size() / 8 + 1));
  EXPECT_TRUE(tree_.start(other, ids.size() / 8 - 1));
}

INSTANTIATE_TEST_SUITE_P(Meshes, SurfaceTreeTest, testing::ValuesIn(kSurfaceMeshes),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace ccslice
