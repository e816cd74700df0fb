// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a cell's pieces know of beyond its faces.

#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "tests/core/interpolation/cell_fitter_fixture.h"

namespace ccslice {
namespace {

// In the cubes of a box, what is beyond the boundary is beyond a plane.
TEST_F(CellFitterTest, PiecesAtASteepBoundaryKnowWhatIsBeyondIt) {
  take(sharp_box(), {[](const Vec3& p) { return p.x() / 8; }}, {.tolerance = 1e-3, .outside_mm = 0.01});
  std::mt19937 random(kSeed);
  for (const LimitCellId cell : solid_->cells()) {
    const Parts parts = examined(cell);
    ASSERT_EQ(parts.size(), 1u);
    const CellPiece& piece = *parts[0].piece;
    const unsigned sides = solid_->data().cells[cell].boundary_sides;
    std::size_t k = 0;
    for (int side = 0; side < 6; ++side) {
      if (!(sides >> side & 1)) continue;
      ASSERT_LT(k, piece.beyond.size());
      for (int n = 0; n < 20; ++n) {
        const Vec3 uvw = random_in({Vec3::Constant(-0.5), Vec3::Constant(1.5)}, random);
        // Cells of this box are cubes, so parameters are shares of it, outside too.
        const Vec3 low = voxel_at(cell, Vec3::Zero());
        Mat3 axes;
        for (int a = 0; a < 3; ++a) axes.col(a) = voxel_at(cell, Vec3::Unit(a)) - low;
        const double share = uvw[side / 2], beyond = side % 2 == 1 ? share - 1 : -share;
        const double value = value_at(piece.beyond[k], piece.frame(low + axes * uvw));
        EXPECT_NEAR(value, beyond + 1e-6, 1e-9) << "cell " << cell << ", side " << side;
      }
      ++k;
    }
    EXPECT_EQ(k, piece.beyond.size());
  }
}

TEST_F(CellFitterTest, WhatIsBeyondCountsWhereChannelsChangeByTheToleranceOutside) {
  const auto gradient = [](const Vec3& p) { return (0.75 * p.x() - p.z()) / 4; };  // 5/16 per mm.
  for (const auto& [share, steep] : {std::pair(0.99, false), {1.01, true}}) {
    take(sharp_box(), {[](const Vec3&) { return 1; }, gradient},
         {.tolerance = 1e-3, .outside_mm = share * 1e-3 / (5.0 / 16)});
    for (const LimitCellId cell : {LimitCellId{0}, LimitCellId{1}, LimitCellId{4}, LimitCellId{13}, LimitCellId{26}}) {
      const unsigned sides = solid_->data().cells[cell].boundary_sides;
      EXPECT_EQ(examined(cell)[0].piece->beyond.size(), steep ? std::popcount(sides) : 0) << cell;
    }
  }
}

// Inside of the part, too, where triangles reach beyond a side at an edge on the boundary.
TEST_F(CellFitterTest, BeyondIsPositiveOnAndOutsideOfBentBoundaries) {
  take(sharp_box(1), {[](const Vec3& p) { return p.x() / 2; }, noise(7)}, {.tolerance = 0.02, .outside_mm = 0.1});
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  FaceSurroundings surroundings(solid_, spec_);
  std::size_t faces = 0, inside = 0, inner = 0;
  for (LimitCellId cell; cell < solid_->cell_count(); cell += 2) {
    const unsigned sides = solid_->data().cells[cell].boundary_sides;
    for (const CellNode& part : examined(cell)) {
      if (part.kind != Kind::kPiece) continue;
      const CellPiece& piece = *part.piece;
      const BlockShape shape = shape_of(piece.points);
      std::size_t k = 0, at_boundary = 0;
      for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const double place = side % 2;
        const double end = side % 2 == 1 ? part.parameters.high[axis] : part.parameters.low[axis];
        if (end != place) continue;
        const bool is_boundary = sides >> side & 1;
        const FaceSurroundings::Piece in_cell{
            cell, piece.points, shape, piece.frame, piece.polynomials, piece.error, own_sides(part.parameters)};
        if (!is_boundary && !surroundings.reaches_into_air(in_cell, static_cast<std::size_t>(side))) continue;
        ASSERT_LT(k, piece.beyond.size());
        const CubicPolynomial& beyond = piece.beyond[k++];
        ++(is_boundary ? faces : inside);
        at_boundary += is_boundary;
        for (int n = 0; n < 20; ++n) {
          Vec3 uvw = random_in(part.parameters, random);
          const double depth = std::abs(uvw[axis] - place) / (part.parameters.high - part.parameters.low)[axis];
          if (depth > 0.3) {
            EXPECT_LE(value_at(beyond, part.piece->frame(voxel_at(cell, uvw))), 0) << depth;
          }
          uvw[axis] = place;
          const Vec3 outwards =
              (side % 2 == 1 ? 1 : -1) * evaluator_->sample({cell, uvw}).jacobian.col(axis).normalized();
          const Vec3 voxel = voxel_at(cell, uvw) + voxel_of_mesh_.linear() * (0.1 * unit(random) * outwards);
          EXPECT_GT(value_at(beyond, part.piece->frame(voxel_at(cell, uvw))), 0) << "seed " << kSeed;
          EXPECT_GT(value_at(beyond, part.piece->frame(voxel)), 0) << "seed " << kSeed;
        }
      }
      EXPECT_EQ(piece.at_boundary, at_boundary > 0);
      EXPECT_EQ(piece.beyond.size(), k);
      inner += k == 0;
    }
  }
  EXPECT_GT(faces, 30u);
  EXPECT_GT(inside, 3u);
  EXPECT_GT(inner, 0u);
}

}  // namespace
}  // namespace ccslice
