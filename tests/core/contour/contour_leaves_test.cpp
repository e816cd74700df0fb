// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_leaves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "tests/core/contour/surface_points.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kLeavesSeed = 20261123;
constexpr double kMargin = 1e-11;  // mm.

/// A place on a face, fixed point or not.
struct Place {
  double s, t;
};

class ContourLeavesTest : public testing::TestWithParam<const char*> {
 protected:
  ContourLeavesTest()
      : points_(oracle::tiny_mesh(GetParam()), kLeavesSeed), leaves_(points_.surface), random_(kLeavesSeed) {
    faces_ = points_.surface.face_ids().to_vector();
  }

  double share() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  LeafCriteria criteria(double tolerance_mm, double small_mm) {
    const auto [low, high] = points_.heights();
    return {points_.axes, low + share() * (high - low), kMargin, tolerance_mm, small_mm, {}};
  }

  /// Just below the top, and beside irregular vertices.
  std::vector<double> telling_heights() {
    std::vector<double> result;
    for (const double below_mm : {1e-4, 1e-3, 1e-2}) result.push_back(points_.heights().second - below_mm);
    for (const BoundaryFaceId face : faces_) {
      if (points_.surface.faces()[face].regular || result.size() > 12) continue;
      for (const double above_mm : {1e-5, -1e-4, 3e-4}) result.push_back(points_.height(face, 0, 0) + above_mm);
    }
    return result;
  }

  bool is_above(const LeafCriteria& at, BoundaryFaceId face, double s, double t) {
    return points_.height(face, s, t) > at.height_mm;
  }

  /// Where the plane cuts the line between two places of a face that lie on different sides.
  Place crossing(const LeafCriteria& at, BoundaryFaceId face, Place from, Place to) {
    const bool from_above = is_above(at, face, from.s, from.t);
    for (int step = 0; step < 60; ++step) {
      const Place middle{0.5 * (from.s + to.s), 0.5 * (from.t + to.t)};
      (is_above(at, face, middle.s, middle.t) == from_above ? from : to) = middle;
    }
    return from;
  }

  bool is_in_leaf(BoundaryFaceId face, const Place& place) const {
    constexpr double kSlack = 1e-9;
    return std::any_of(leaves_.leaves().begin(), leaves_.leaves().end(), [&](const ContourLeaf& leaf) {
      const SurfaceBox& box = leaves_.surface(leaf).node.box;
      const double s = box.s / double{kSurfaceOne}, t = box.t / double{kSurfaceOne},
                   size = box.size / double{kSurfaceOne};
      return box.face == face && place.s >= s - kSlack && place.s <= s + size + kSlack && place.t >= t - kSlack &&
             place.t <= t + size + kSlack;
    });
  }

  using Key = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, bool>;
  static std::vector<Key> keys(const ContourLeaves& leaves) {
    std::vector<Key> result;
    for (const ContourLeaf& leaf : leaves.leaves()) {
      const SurfaceBox& box = leaves.surface(leaf).node.box;
      result.emplace_back(box.face, box.s, box.t, box.size, leaf.resolved);
    }
    return result;
  }

  SurfacePoints points_;
  ContourLeaves leaves_;
  std::vector<BoundaryFaceId> faces_;
  std::mt19937 random_;
};

TEST_P(ContourLeavesTest, HoldEveryPlaceThatThePlaneCuts) {
  int crossings = 0;
  for (int trial = 0; trial < 6; ++trial) {
    const LeafCriteria at = criteria(0.01, 0.1);
    leaves_.collect(faces_, at);
    for (const BoundaryFaceId face : faces_) {
      for (int k = 0; k < 10; ++k) {
        const Place from{share(), share()}, to{share(), share()};
        if (is_above(at, face, from.s, from.t) == is_above(at, face, to.s, to.t)) continue;
        ++crossings;
        ASSERT_TRUE(is_in_leaf(face, crossing(at, face, from, to))) << "seed " << kLeavesSeed << ", face " << face;
      }
    }
  }
  EXPECT_GT(crossings, 100);
}

TEST_P(ContourLeavesTest, DontOverlap) {
  std::size_t leaves = 0;
  for (int trial = 0; trial < 5; ++trial) {
    leaves_.collect(faces_, criteria(0.001, 0.02));
    std::vector<Key> boxes = keys(leaves_);
    leaves += boxes.size();
    std::sort(boxes.begin(), boxes.end());
    for (std::size_t a = 0; a < boxes.size(); ++a) {
      const auto& [face, s, t, size, resolved] = boxes[a];
      for (std::size_t b = a + 1; b < boxes.size() && std::get<0>(boxes[b]) == face; ++b) {
        const auto& [other_face, s1, t1, size1, other_resolved] = boxes[b];
        ASSERT_TRUE(s1 >= s + size || s >= s1 + size1 || t1 >= t + size || t >= t1 + size1);
      }
    }
  }
  EXPECT_GT(leaves, 50u);
}

/// How often the rim of a net changes sides, at most once a side; and if it doesn't, that the inside doesn't either.
void expect_no_loop_inside(const BezierNet& net, double height) {
  constexpr int kSteps = 16;
  int around = 0;
  for (int side = 0; side < 4; ++side) {
    const std::array<double, 4> z = side_curve(net, side).z;
    int changes = 0;
    for (int k = 0; k < kSteps; ++k) {
      changes += (evaluate(z, double(k) / kSteps) > height) != (evaluate(z, double(k + 1) / kSteps) > height);
    }
    EXPECT_LE(changes, 1);
    around += changes;
  }
  EXPECT_LE(around, 2);
  if (around > 0) return;
  for (const BezierNet& quarter : quarters_of(net)) EXPECT_EQ(evaluate_middle(quarter.z) > height, net.z[0] > height);
  EXPECT_EQ(evaluate_middle(net.z) > height, net.z[0] > height);
}

// Resolved: no loop inside, no side cut twice. Others are small.
TEST_P(ContourLeavesTest, AreResolvedOrSmall) {
  std::vector<LeafCriteria> layers;
  for (const double small_mm : {1e-3, 2.0}) {
    layers.insert(layers.end(), {criteria(0.02, small_mm), criteria(0.02, small_mm)});
    for (const double height : telling_heights()) {
      layers.push_back(layers.back());
      layers.back().height_mm = height;
    }
  }
  std::size_t resolved = 0;
  for (const LeafCriteria& at : layers) {
    leaves_.collect(faces_, at);
    for (const ContourLeaf& leaf : leaves_.leaves()) {
      const auto [node, net] = leaves_.surface(leaf);
      if (node.remainder) {
        EXPECT_LE(node.diagonal, std::min(0.125 * at.tolerance_mm, at.small_mm));
      } else if (!leaf.resolved) {
        EXPECT_LE(node.diagonal, at.small_mm);
      } else {
        ++resolved;
        expect_no_loop_inside(net, at.height_mm);
        const bool followed = node.level_lines != LevelLines::kOpen && node.level_lines != LevelLines::kUnknown;
        EXPECT_TRUE(followed || node.chord.whole() <= at.tolerance_mm);
      }
    }
  }
  EXPECT_GT(resolved, 50u);
}

TEST_P(ContourLeavesTest, KnowTheSidesOfTheirCorners) {
  for (int trial = 0; trial < 6; ++trial) {
    const LeafCriteria at = criteria(0.01, 0.1);
    leaves_.collect(faces_, at);
    for (const ContourLeaf& leaf : leaves_.leaves()) {
      const SurfaceNode& node = leaves_.surface(leaf).node;
      for (int k = 0; k < 4; ++k) {
        const auto [s, t] = node.box.corner(k);
        const double height = points_.at_vertex(node.box.face, s, t).z() - at.height_mm;
        if (std::abs(height) < 1e-9) continue;
        EXPECT_EQ(leaves_.side(node.corners[k]), height > 0 ? PlaneSide::kAbove : PlaneSide::kBelow);
      }
    }
  }
}

TEST_P(ContourLeavesTest, ShareEachEdgeThatThePlaneCutsWithOneOther) {
  std::size_t cut = 0;
  for (int trial = 0; trial < 15; ++trial) {
    const double tolerance_mm = trial % 3 == 0 ? 0.005 : trial % 3 == 1 ? 0.5 : 5;
    const LeafCriteria at = criteria(tolerance_mm, 10 * tolerance_mm);
    leaves_.collect(faces_, at);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;  // Directed.
    for (const ContourLeaf& leaf : leaves_.leaves()) {
      const BoundaryFaceId face = leaves_.surface(leaf).node.box.face;
      std::vector<std::pair<std::uint32_t, std::uint32_t>> rim;
      leaves_.walk_rim(leaf, [&](int, const RimVertex& from, const RimVertex& to) {
        EXPECT_TRUE(rim.empty() || rim.back().second == from.id);
        rim.emplace_back(from.id, to.id);
        const double z0 = points_.at_vertex(face, from.s, from.t).z() - at.height_mm;
        const double z1 = points_.at_vertex(face, to.s, to.t).z() - at.height_mm;
        if ((z0 > 0) != (z1 > 0) && std::min(std::abs(z0), std::abs(z1)) > 1e-9) ++edges[rim.back()];
      });
      EXPECT_EQ(rim.front().first, rim.back().second);
    }
    cut += edges.size();
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1) << "seed " << kLeavesSeed << ", trial " << trial;
      ASSERT_TRUE(edges.contains({edge.second, edge.first})) << "seed " << kLeavesSeed << ", trial " << trial;
    }
  }
  EXPECT_GT(cut, 100u);
}

TEST_P(ContourLeavesTest, DependOnNothingBefore) {
  std::vector<LeafCriteria> layers;
  for (int k = 0; k < 6; ++k) layers.push_back(criteria(0.01, 0.1));
  layers[3].to_axes.offset.z() += 0.5;
  for (const LeafCriteria& layer : layers) {
    leaves_.collect(faces_, layer);
    ContourLeaves fresh(points_.surface);
    fresh.collect(faces_, layer);
    EXPECT_EQ(keys(leaves_), keys(fresh));
  }
}

TEST_P(ContourLeavesTest, AreNoneBeyondTheMargin) {
  LeafCriteria at = criteria(0.01, 0.1);
  at.height_mm = points_.heights().second + 100;
  leaves_.collect(faces_, at);
  EXPECT_TRUE(leaves_.leaves().empty());
  at.margin_mm = 1000;
  leaves_.collect(faces_, at);
  EXPECT_FALSE(leaves_.leaves().empty());
}

TEST_P(ContourLeavesTest, CollectingThemCanBeCancelled) {
  LeafCriteria at = criteria(0.01, 0.1);
  at.cancel = CancellationToken::make();
  leaves_.collect(faces_, at);
  at.cancel.cancel();
  EXPECT_THROW(leaves_.collect(faces_, at), Error);
}

INSTANTIATE_TEST_SUITE_P(Meshes, ContourLeavesTest, testing::ValuesIn(kSurfaceMeshes),
                         [](const auto& info) { return std::string(info.param); });

TEST(PlaneSide, AHeightOfZeroIsBelow) {
  EXPECT_EQ(side_of(0.0), PlaneSide::kBelow);
  EXPECT_EQ(side_of(-0.0), PlaneSide::kBelow);
  EXPECT_EQ(side_of(-1e-300), PlaneSide::kBelow);
  EXPECT_EQ(side_of(1e-300), PlaneSide::kAbove);
}

}  // namespace
}  // namespace ccslice
