// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "core/interpolation/pieces/block_arcs.h"
#include "core/interpolation/pieces/block_faces.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kShapeSeed = 20261123;

BlockPoints shape_block(const std::function<Vec3(const Vec3&)>& map) {
  BlockPoints points;
  for (std::size_t n = 0; n < points.size(); ++n) {
    points[n] = map(Vec3(static_cast<double>(n % 5), static_cast<double>(n / 5 % 5), static_cast<double>(n / 25)) / 4);
  }
  return points;
}

TEST(BlockShape, OfAParallelepipedIsItsEdges) {
  std::mt19937 random(kShapeSeed);
  std::uniform_real_distribution<double> unit(-20, 20);
  for (int trial = 0; trial < 50; ++trial) {
    Mat3 edges;
    for (double& x : edges.reshaped()) x = unit(random);
    const Vec3 origin(unit(random), unit(random), unit(random));
    const BlockShape shape = shape_of(shape_block([&](const Vec3& p) -> Vec3 { return origin + edges * p; }));
    EXPECT_FALSE(shape.flat);
    EXPECT_NEAR(shape.voxels, std::abs(edges.determinant()), 1e-9) << "seed " << kShapeSeed;
    EXPECT_LT((shape.inverse_axes * edges - Mat3::Identity()).norm(), 1e-9);
    EXPECT_EQ(shape.step, 4u);
    EXPECT_NEAR(shape.bulge.maxCoeff(), 0, 1e-9);
    EXPECT_NEAR(shape.miss, 0, 1e-9);
    EXPECT_EQ(shape.bent_axes(), 0u);
    Box3 box;
    for (int corner = 0; corner < 8; ++corner) {
      box.extend(origin + edges * Vec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1));
    }
    EXPECT_LT((box.min() - shape.box.min()).norm() + (box.max() - shape.box.max()).norm(), 1e-9);
  }
}

TEST(BlockShape, IsAsThickAlongXAsALineOfVoxelsIsLongInIt) {
  const BlockShape box = shape_of(shape_block([](const Vec3& p) { return Vec3(7 * p.x(), 30 * p.y(), 30 * p.z()); }));
  EXPECT_NEAR(box.thickness_along_x(), 7, 1e-12);
  // Its faces u = 0 and u = 1 are diagonal.
  const BlockShape sheared =
      shape_of(shape_block([](const Vec3& p) { return Vec3(7 * p.x() + 30 * p.y(), 30 * p.y(), 30 * p.z()); }));
  EXPECT_NEAR(sheared.thickness_along_x(), 7, 1e-12);
  // Along y it is 3 voxels thick, and lies at 45 degrees.
  const BlockShape turned = shape_of(
      shape_block([](const Vec3& p) { return Vec3(30 * p.x() + 3 * p.y(), 30 * p.x() - 3 * p.y(), 30 * p.z()); }));
  EXPECT_NEAR(turned.thickness_along_x(), 6, 1e-12);
}

/// Parabolas along u, so high that their tops are `rise` voxels above their ends: 40 voxels thick across them.
BlockShape arched(double rise) {
  return shape_of(shape_block(
      [rise](const Vec3& p) { return Vec3(300 * p.x(), 40 * p.y() + 4 * rise * p.x() * (1 - p.x()), 20 * p.z()); }));
}

// Over a half of it, an arc of a parabola is a quarter as high.
TEST(BlockShape, TrianglesAreAsLargeAsBulgesAllow) {
  for (const double rise : {0.0, 0.1, 0.19, 0.21, 0.5, 0.79, 0.81, 3.0, 31.9}) {
    const BlockShape shape = arched(rise);
    const std::size_t step = rise < 0.2 ? 4 : rise < 0.8 ? 2 : 1;
    EXPECT_EQ(shape.step, step) << rise;
    const double share = rise * static_cast<double>(step * step) / 16 / 40;
    EXPECT_LT((shape.bulge - Vec3(share, 0, 0)).norm(), 1e-9) << rise;
    EXPECT_NEAR(shape.miss, share, 1e-9);
    EXPECT_EQ(shape.bent_axes(), 0u);
  }
  EXPECT_EQ(arched(32.1).bent_axes(), 0b001u);  // A twentieth of the thickness between neighbouring nodes.
}

/// An arc between nodes that are a multiple of `step` apart: how far it is off chords between those at most.
double most_off_chords(const std::function<double(double)>& arc, std::size_t step) {
  constexpr std::size_t kPlaces = 200;
  const double length = static_cast<double>(step) / 4;
  double most = 0;
  for (std::size_t n = 0; n < 4; n += step) {
    const double begin = static_cast<double>(n) / 4;
    for (std::size_t k = 0; k < kPlaces; ++k) {
      const double share = static_cast<double>(k) / kPlaces;
      const double chord = (1 - share) * arc(begin) + share * arc(begin + length);
      most = std::max(most, std::abs(chord - arc(begin + share * length)));
    }
  }
  return most;
}

// Halfway such an arc meets its chord.
TEST(BlockShape, ArcsWithAnInflectionBulgeBesideTheirMiddle) {
  for (const double rise : {0.1, 0.19, 0.21, 3.0, 15.0}) {
    const auto wave = [rise](double x) { return rise * x * (x - 0.5) * (x - 1) / 0.048113; };  // `rise` at most.
    const BlockShape shape =
        shape_of(shape_block([&](const Vec3& p) { return Vec3(300 * p.x(), 40 * p.y() + wave(p.x()), 20 * p.z()); }));
    EXPECT_EQ(shape.step, rise < 0.2 ? 4u : 1u) << rise;  // Halves are as high.
    const double share = most_off_chords(wave, shape.step) / 40;
    EXPECT_GE(shape.bulge.x(), 0.999 * share) << rise;
    EXPECT_LE(shape.bulge.x(), 1.1 * share) << rise;
    EXPECT_GE(shape.miss, 0.999 * share) << rise;
    EXPECT_LE(shape.miss, 1.1 * share) << rise;
  }
}

TEST(BlockShape, NoCubicArcBulgesMoreThanItSays) {
  std::mt19937 random(kShapeSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    const double size = std::pow(10, 1.5 * unit(random));
    const std::array<double, 3> c = {size * unit(random), size * unit(random), size * unit(random)};
    const auto arc = [&](double x) { return ((c[2] * x + c[1]) * x + c[0]) * x; };
    const BlockShape shape =
        shape_of(shape_block([&](const Vec3& p) { return Vec3(300 * p.x(), 40 * p.y() + arc(p.x()), 20 * p.z()); }));
    const double share = most_off_chords(arc, shape.step) / 40;
    EXPECT_GE(shape.bulge.x(), 0.999 * share) << "trial " << trial << ", seed " << kShapeSeed;
    EXPECT_GE(shape.miss, 0.999 * share) << "trial " << trial << ", seed " << kShapeSeed;
    if (shape.step > 1) {
      EXPECT_LE(40 * share, 0.201) << "trial " << trial << ", seed " << kShapeSeed;
    }
  }
}

TEST(BlockShape, ThinBlocksHaveSmallerTriangles) {
  // A tenth of a voxel is more than a hundredth of the thickness.
  const BlockShape thin = shape_of(
      shape_block([](const Vec3& p) { return Vec3(30 * p.x(), 5 * p.y() + 0.4 * p.x() * (1 - p.x()), 20 * p.z()); }));
  EXPECT_EQ(thin.step, 2u);
  EXPECT_LT((thin.bulge - Vec3(0.1 / 4 / 5, 0, 0)).norm(), 1e-9);
}

/// Faces w = 0 and w = 1 are hyperbolic paraboloids whose corners lie `twist` / 4 off a plane.
BlockShape twisted(double twist) {
  return shape_of(shape_block([twist](const Vec3& p) {
    return Vec3(900 * p.x(), 900 * p.y(), 20 * p.z() + twist * (p.x() - 0.5) * (p.y() - 0.5));
  }));
}

TEST(BlockShape, TrianglesMissTwistedFacesByAQuarterOfTheTwist) {
  for (const double twist : {0.5, 3.0, 100.0, 250.0}) {
    const BlockShape shape = twisted(twist);
    EXPECT_EQ(shape.step, twist < 0.8 ? 4u : twist < 3.2 ? 2u : 1u) << twist;
    const double parts = 4.0 / static_cast<double>(shape.step);
    EXPECT_LT(shape.bulge.norm(), 1e-9);
    EXPECT_NEAR(shape.miss, 0.25 * twist / (parts * parts) / 20, 1e-9) << twist;
    EXPECT_EQ(shape.bent_axes(), 0u);
  }
  EXPECT_EQ(twisted(260).bent_axes(), 0b011u);  // A fifth of the thickness.
}

// From 2 to 40 voxels thick. Nodes aren't equidistant along u: what they are off along the block's middle, which shows
// nothing across it, is across the faces.
TEST(BlockShape, FacesOfTaperedBlocksAreMissedAcrossThemselves) {
  const auto tapered = [](double grading) {
    return shape_of(shape_block([grading](const Vec3& p) {
      return Vec3(30 * (p.x() + grading * p.x() * (1 - p.x())), 20 * p.y(), (p.z() - 0.5) * (2 + 38 * p.x()));
    }));
  };
  EXPECT_LT(tapered(0).miss, 1e-9);
  for (const double grading : {-0.4, 0.4}) {
    const BlockShape shape = tapered(grading);
    EXPECT_EQ(shape.step, 1u);
    EXPECT_LT(shape.bulge.norm(), 1e-9);
    // Of the last half, or the first: there nodes are 0.8 times as far apart as in the middle.
    EXPECT_NEAR(shape.miss, 19 * 0.4 / 64 / 21 / 0.8, 1e-9) << grading;
  }
}

/// How far the chord from the first node to the last of these is off the arc through the five nodes of a row.
double off_chord(const std::array<double, 5>& heights, std::size_t from, std::size_t step) {
  const auto bends = bends_of<double>([&](std::size_t n) { return heights[n]; });
  double middle = std::abs(bends.middle(from, step));
  if (step == 1) middle = std::max(middle, std::abs(bends.at[from > 0 ? from - 1 : 0]) / 8);
  return highest_over_arc(middle, std::abs(cubic_of(bends, step))).height;
}

struct ExpectedMiss {
  double most;
  unsigned axes;
};

/// Raises what is missed by the quadrilateral of a face from node (s, t) on, across that from `corner` on.
void miss_quad(const BlockPoints& points, const BlockShape& shape, std::size_t side, std::array<std::size_t, 2> corner,
               std::array<std::size_t, 2> at, ExpectedMiss& expected) {
  const BlockFace face(side / 2, side % 2);
  const std::size_t step = shape.step, size = std::max<std::size_t>(step, 2);
  const auto node = [&](std::size_t s, std::size_t t) { return points[face.node(s, t)]; };
  const auto [s0, t0] = corner;
  const Vec3 rising = node(s0 + size, t0 + size) - node(s0, t0), falling = node(s0 + size, t0) - node(s0, t0 + size);
  const Vec3 normal = (rising + falling).cross(rising - falling);
  const Vec3 outwards = normal / normal.dot(shape.axes.col(static_cast<Eigen::Index>(side / 2)));
  const auto [s, t] = at;
  double of_s = 0, of_t = 0;
  for (std::size_t n = 0; n <= step; ++n) {
    std::array<double, 5> along_s, along_t;
    for (std::size_t k = 0; k < 5; ++k) {
      along_s[k] = outwards.dot(node(k, t + n) - node(0, t + n));
      along_t[k] = outwards.dot(node(s + n, k) - node(s + n, 0));
    }
    of_s = std::max(of_s, off_chord(along_s, s, step));
    of_t = std::max(of_t, off_chord(along_t, t, step));
  }
  const double twist =
      0.25 * std::abs(outwards.dot(node(s, t) + node(s + step, t + step) - node(s + step, t) - node(s, t + step)));
  const double most = of_s + of_t + twist;
  if (most <= expected.most) return;
  const std::size_t axis = side / 2;
  expected.most = most;
  expected.axes =
      (of_s + twist > most / 4 ? 1u << (axis + 1) % 3 : 0) | (of_t + twist > most / 4 ? 1u << (axis + 2) % 3 : 0);
}

// One after another, and none left out as it can't be the one.
TEST(BlockShape, FacesAreMissedByTheWorstOfTheirQuadrilaterals) {
  std::mt19937 random(kShapeSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::array<int, 5> steps{};
  for (int trial = 0; trial < 600; ++trial) {
    const double bend = std::exp(4 * unit(random) - 1), noise = trial % 2 == 0 ? 0 : 0.1 * bend;
    Eigen::Matrix<double, 3, 8> terms;
    for (double& term : terms.reshaped()) term = bend * unit(random);
    const BlockPoints points = shape_block([&](const Vec3& p) -> Vec3 {
      const double u = p.x(), v = p.y(), w = p.z();
      Eigen::Matrix<double, 8, 1> powers;
      powers << u * u, v * v, w * w, u * v, v * w, w * u, u * u * u - u * u, v * v * v - w * w * v;
      return 100 * p + terms * powers + noise * Vec3(unit(random), unit(random), unit(random));
    });
    const BlockShape shape = shape_of(points);
    ++steps[shape.step];
    ExpectedMiss expected{shape.bulge.maxCoeff(), 0};
    for (std::size_t side = 0; side < 6; ++side) {
      const std::size_t size = std::max<std::size_t>(shape.step, 2);
      for_each_quad(size, [&](std::size_t s0, std::size_t t0) {
        for (std::size_t t = t0; t < t0 + size; t += shape.step) {
          for (std::size_t s = s0; s < s0 + size; s += shape.step) {
            miss_quad(points, shape, side, {s0, t0}, {s, t}, expected);
          }
        }
      });
    }
    ASSERT_NEAR(shape.miss, expected.most, 1e-9 * expected.most) << "trial " << trial << " step " << shape.step;
    ASSERT_EQ(shape.axes_of_miss, expected.axes) << "trial " << trial << " step " << shape.step;
  }
  for (const std::size_t step : {1, 2, 4}) EXPECT_GT(steps[step], 20) << step;
}

TEST(BlockShape, WithoutVolumeIsFlat) {
  EXPECT_TRUE(shape_of(shape_block([](const Vec3& p) { return Vec3(9 * p.x(), 9 * p.y(), 0); })).flat);
  EXPECT_FALSE(shape_of(shape_block([](const Vec3& p) { return Vec3(9 * p.x(), 9 * p.y(), 1e-3 * p.z()); })).flat);
}

}  // namespace
}  // namespace ccslice
