// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/surface_pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

bool holds(const SlantedBox& box, const Vec3& point) {
  constexpr double kRounding = 1e-9;
  const Vec3 slanted = box.axes * point;
  return box.box.exteriorDistance(point) < kRounding && Box3(box.low, box.high).exteriorDistance(slanted) < kRounding;
}

TEST(SurfacePieces, HoldTheWholeFaceHoweverOftenTheyAreQuartered) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    const BoundarySurface surface(*solid);
    LimitEvaluator evaluator(*solid);
    SurfacePieces pieces(surface);
    for (const BoundaryFaceId face : surface.face_ids()) {
      const SlantedBox box = pieces.box_of(face);
      pieces.start(face);
      const std::uint32_t roots = pieces.roots();
      EXPECT_EQ(roots, surface.faces()[face].regular ? 1u : 4u);
      std::vector<std::uint32_t> leaves;
      for (std::uint32_t root = 0; root < roots; ++root) {
        const std::uint32_t first = pieces.quarters(root);
        EXPECT_EQ(pieces.quarters(root), first) << "made once";
        for (std::uint32_t k = 0; k < 4; ++k) leaves.push_back(first + k);
      }
      for (int i = 0; i < 20; ++i) {
        const Vec3 point = evaluator.geo(surface.cell_param(face, unit(random), unit(random)));
        EXPECT_TRUE(holds(box, point)) << name;
        EXPECT_TRUE(std::ranges::any_of(leaves, [&](std::uint32_t leaf) { return holds(pieces[leaf].box, point); }))
            << name;
      }
      for (const std::uint32_t leaf : leaves) {
        for (const Vec3& corner : pieces[leaf].corners) EXPECT_TRUE(holds(box, corner)) << name;
      }
    }
  }
}

TEST(SurfacePieces, LookOutwards) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  const BoundarySurface surface(*solid);
  SurfacePieces pieces(surface);
  for (const BoundaryFaceId face : surface.face_ids()) {
    const SlantedBox box = pieces.box_of(face);
    ASSERT_TRUE(box.has_normal);
    EXPECT_GT(box.axes.row(2).dot(box.box.center() - Vec3::Constant(5)), 1);
  }
}

/// A square of so many millimetres in the plane z = 0 that looks upwards, turned and moved.
SlantedBox square(double size_mm, const Mat3& turn, const Vec3& offset) {
  const std::array<Vec3, 4> corners = {offset, offset + turn * Vec3(size_mm, 0, 0),
                                       offset + turn * Vec3(size_mm, size_mm, 0), offset + turn * Vec3(0, size_mm, 0)};
  std::array<PaddedPoint, 4> points;
  for (std::size_t i = 0; i < 4; ++i) points[i] << corners[i], 0;
  return SlantedBox::around(points, corners);
}

Mat3 about(const Vec3& axis, double degrees) {
  return Eigen::AngleAxisd(degrees * 3.14159265358979 / 180, axis.normalized()).toRotationMatrix();
}

TEST(SlantedBox, TellsSquaresThatCantCross) {
  constexpr double kLeast = 1e-3;
  for (const Vec3& tilt : {Vec3(0, 0, 0), Vec3(1, 2, 3), Vec3(-2, 1, 0.5)}) {
    const Mat3 turn = tilt.isZero() ? Mat3(Mat3::Identity()) : about(tilt, 37);
    const auto placed = [&](const Mat3& own, const Vec3& offset) { return square(1, turn * own, turn * offset); };
    const SlantedBox base = placed(Mat3::Identity(), Vec3::Zero());
    const Mat3 wall = about(Vec3::UnitX(), 90), ceiling = about(Vec3::UnitX(), 180);
    const auto off = [&](const SlantedBox& other) {
      EXPECT_EQ(cannot_cross(base, other, kLeast), cannot_cross(other, base, kLeast));
      return cannot_cross(base, other, kLeast);
    };
    EXPECT_TRUE(off(placed(Mat3::Identity(), Vec3(0, 0, 0.5)))) << "above";
    EXPECT_TRUE(off(placed(Mat3::Identity(), Vec3(0, 0, -0.5)))) << "deep below";
    EXPECT_TRUE(off(placed(Mat3::Identity(), Vec3(1.1, 0, 0)))) << "beside";
    EXPECT_TRUE(off(placed(ceiling, Vec3(0, 1, 0)))) << "face to face";
    EXPECT_FALSE(off(placed(wall, Vec3(0, 0.5, -0.5)))) << "through it";
    EXPECT_TRUE(off(placed(wall, Vec3(0, 0.5, 0)))) << "standing on it";
    EXPECT_FALSE(off(placed(wall, Vec3(0, 0.5, -1)))) << "hanging below it";
    EXPECT_TRUE(off(placed(wall, Vec3(0, 0.5, -1.1)))) << "below it";
  }
}

TEST(SlantedBox, LiesAlongTheAxesWithoutANormal) {
  const std::array<Vec3, 4> line = {Vec3(0, 0, -1), Vec3(1, 1, 0), Vec3(2, 2, 1), Vec3(1, 1, 0)};
  std::array<PaddedPoint, 4> points;
  for (std::size_t i = 0; i < 4; ++i) points[i] << line[i], 0;
  const SlantedBox box = SlantedBox::around(points, line);
  EXPECT_FALSE(box.has_normal);
  EXPECT_FALSE(cannot_cross(box, square(1, Mat3::Identity(), Vec3(0.5, 0.5, 0)), 1e-3));
  EXPECT_TRUE(cannot_cross(box, square(1, Mat3::Identity(), Vec3(2.5, 0.5, 0)), 1e-3));
}

}  // namespace
}  // namespace ccslice
