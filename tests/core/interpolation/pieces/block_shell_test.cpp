// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_shell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace ccslice {
namespace {

BlockPoints shell_block(const std::function<Vec3(const Vec3&)>& map) {
  BlockPoints points;
  for (std::size_t n = 0; n < points.size(); ++n) {
    points[n] = map(Vec3(static_cast<double>(n % 5), static_cast<double>(n / 5 % 5), static_cast<double>(n / 25)) / 4);
  }
  return points;
}

/// 300 x 40 x 20 voxels, whose face w = 1 rises by `rise` voxels in its middle: a parabola along u and, if it is
/// `round`, one along v as well.
BlockPoints bowed(double rise, bool round = false) {
  return shell_block([=](const Vec3& p) {
    const double along_v = round ? 4 * p.y() * (1 - p.y()) : 0;
    return Vec3(300 * p.x(), 40 * p.y(), p.z() * (20 + rise * (4 * p.x() * (1 - p.x()) + along_v)));
  });
}

BlockShell shell_of(const BlockPoints& points, std::size_t side) {
  BlockShell shell;
  shell.find(points, shape_of(points), side);
  return shell;
}

constexpr std::size_t kTop = 5;

TEST(BlockShell, FlatFacesHaveNone) {
  const BlockPoints points =
      shell_block([](const Vec3& p) { return Vec3(30 * p.x() + 7 * p.y(), 20 * p.y(), 10 * p.z() - 3 * p.x()); });
  for (std::size_t side = 0; side < 6; ++side) {
    const BlockShell shell = shell_of(points, side);
    EXPECT_EQ(shell.depth(), 0) << side;
    EXPECT_TRUE(shell.places().empty() && shell.quads().empty()) << side;
  }
}

TEST(BlockShell, FacesThatBulgeOutHaveNone) {
  for (const double rise : {0.1, 0.5, 3.0}) EXPECT_EQ(shell_of(bowed(rise), kTop).depth(), 0) << rise;
}

// Between every step-th node a parabola is as deep as the square of that is small.
TEST(BlockShell, OfHollowFacesIsAsDeepAsTheirArcs) {
  for (const double rise : {-0.1, -0.5, -3.0}) {
    for (const bool round : {false, true}) {
      const BlockPoints points = bowed(rise, round);
      const BlockShape shape = shape_of(points);
      const BlockShell shell = shell_of(points, kTop);
      const double thickness = 20 + (round ? 2 : 1) * rise;  // In the middle, by whose axes shares are measured.
      const double arc = -rise * static_cast<double>(shape.step * shape.step) / 16 / thickness;
      EXPECT_NEAR(shell.depth(), (round ? 2 : 1) * arc, 1e-9) << rise;
      const std::size_t quads = 16 / (shape.step * shape.step);
      EXPECT_EQ(shell.quads().size(), quads) << rise;
      EXPECT_EQ(shell_of(points, kTop - 1).depth(), 0);
    }
  }
}

TEST(BlockShell, PlacesLieOnTheTriangles) {
  const BlockPoints points = bowed(-3);
  const BlockShell shell = shell_of(points, kTop);
  ASSERT_FALSE(shell.places().empty());
  for (const BlockShell::Place& place : shell.places()) {
    const double u = place.voxel.x() / 300, step = static_cast<double>(shape_of(points).step) / 4;
    const double begin = std::floor(u / step) * step, share = (u - begin) / step;
    const auto height = [](double at) { return 20 - 3 * 4 * at * (1 - at); };
    EXPECT_NEAR(place.voxel.z(), (1 - share) * height(begin) + share * height(begin + step), 1e-9);
    EXPECT_NEAR(place.depth, (place.voxel.z() - height(u)) / 17, 1e-9);
  }
}

// The middle of such a face is where the triangles are, and either half of it elsewhere.
TEST(BlockShell, FacesWithAnInflectionHaveOneOnEitherSide) {
  for (const double rise : {0.3, 3.0, 30.0}) {
    const BlockPoints points = shell_block([=](const Vec3& p) {
      const double wave = p.x() * (p.x() - 0.5) * (p.x() - 1) / 0.048113;  // 1 at most.
      return Vec3(300 * p.x(), 40 * p.y(), 20 * p.z() + rise * wave);
    });
    const BlockShape shape = shape_of(points);
    const double share = std::pow(static_cast<double>(shape.step) / 4, 3);  // Of the cubic part, by the edges' length.
    for (const std::size_t side : {kTop, kTop - 1}) {
      const double depth = shell_of(points, side).depth();
      if (shape.step == 4) {
        EXPECT_NEAR(depth, 0.974 * rise / 20, 1e-3 * rise / 20) << rise;
      } else {
        EXPECT_GT(depth, share * rise / 20) << rise;
      }
    }
  }
}

// On one side of the inflection the chord is outside, on the other one the face.
TEST(BlockShell, PlacesBesideAnInflectionAreOutside) {
  for (const double rise : {-1.0, 1.0}) {
    const auto height = [rise](double u) { return 20 + rise * (u - 0.125) * (u - 0.25) * (u - 0.375); };
    const BlockPoints points =
        shell_block([&](const Vec3& p) { return Vec3(300 * p.x(), 40 * p.y(), p.z() * height(p.x())); });
    const std::size_t step = shape_of(points).step;
    EXPECT_EQ(step, 2u);
    const BlockShell shell = shell_of(points, kTop);
    ASSERT_FALSE(shell.places().empty());
    for (const BlockShell::Place& place : shell.places()) {
      const double u = place.voxel.x() / 300, length = static_cast<double>(step) / 4;
      const double begin = std::floor(u / length) * length, share = (u - begin) / length;
      const double chord = (1 - share) * height(begin) + share * height(begin + length);
      EXPECT_GT(chord, height(u)) << "rise " << rise << ", u " << u << ", step " << step;
    }
  }
}

// From 2 to 40 voxels thick, with nodes that aren't equidistant along u: across the block's middle, its faces' arcs
// rise as evenly as their chords.
TEST(BlockShell, OfTaperedFacesIsMeasuredAcrossThem) {
  for (const double grading : {0.4, -0.4}) {
    const BlockPoints points = shell_block([grading](const Vec3& p) {
      return Vec3(30 * (p.x() + grading * p.x() * (1 - p.x())), 20 * p.y(), (p.z() - 0.5) * (2 + 38 * p.x()));
    });
    ASSERT_EQ(shape_of(points).step, 1u);
    const BlockShell shell = shell_of(points, kTop);
    if (grading < 0) {
      EXPECT_EQ(shell.depth(), 0);
      continue;
    }
    // Where x = 30 u + 12 u (1 - u), the face is at 1 + 19 u; at the middle of a chord that is too small a height.
    double deepest = 0;
    for (int n = 0; n < 4; ++n) {
      const double u = (n + 0.5) / 4, x = 30 * u + 12 * u * (1 - u) - 12.0 / 64;
      const double at = (42 - std::sqrt(42 * 42 - 48 * x)) / 24;
      deepest = std::max(deepest, 19 * (u - at) / 21);
    }
    EXPECT_GT(shell.depth(), 0.9 * deepest);
    EXPECT_LT(shell.depth(), 1.4 * deepest);
    EXPECT_EQ(shell.quads().size(), 16u);
  }
}

// One of a saddle's diagonals lies outside, whichever the triangles share.
TEST(BlockShell, SaddlesHaveShellsOnBothSides) {
  const BlockPoints points = shell_block([](const Vec3& p) {
    const double twist = 8 * (p.x() - 0.5) * (p.y() - 0.5);
    return Vec3(40 * p.x() + 1e-3 * p.y(), 40 * p.y(), 20 * p.z() + twist);
  });
  EXPECT_GT(shell_of(points, kTop).depth() + shell_of(points, kTop - 1).depth(), 1e-3);
}

}  // namespace
}  // namespace ccslice
