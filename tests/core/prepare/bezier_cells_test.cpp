// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/bezier_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

std::array<double, 4> bernstein(double t) {
  const double s = 1 - t;
  return {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
}

/// Points of a cell in turn: 64, or 8.
std::vector<std::vector<std::uint32_t>> cells_of(const BezierCells& cells) {
  std::vector<std::vector<std::uint32_t>> found;
  auto at = cells.cell_points.begin();
  for (const std::uint8_t order : cells.cell_orders) {
    const int size = order == 3 ? 64 : 8;
    found.emplace_back(at, at + size);
    at += size;
  }
  EXPECT_EQ(at, cells.cell_points.end());
  return found;
}

Vec3 position_in(const BezierCells& cells, const std::vector<std::uint32_t>& points, const Vec3& uvw) {
  Vec3 sum = Vec3::Zero();
  const auto u = bernstein(uvw[0]), v = bernstein(uvw[1]), w = bernstein(uvw[2]);
  for (std::size_t i = 0; i < 64; ++i) sum += u[i % 4] * v[i / 4 % 4] * w[i / 16] * cells.points[points[i]];
  return sum;
}

/// Of the trilinear cells and the others: integral of det J, by Gauss points that are exact for degree 8.
double volume_of(const BezierCells& cells) {
  constexpr std::array<double, 5> kNodes = {0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415,
                                            0.953089922969332};
  constexpr std::array<double, 5> kWeights = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                              0.23931433524968324, 0.11846344252809454};
  constexpr double kStep = 1e-3;
  double volume = 0;
  const auto all = cells_of(cells);
  for (std::size_t cell = 0; cell < all.size(); ++cell) {
    const auto at = [&](const Vec3& uvw) -> Vec3 {
      if (cells.cell_orders[cell] == 3) return position_in(cells, all[cell], uvw);
      Vec3 sum = Vec3::Zero();
      for (std::size_t i = 0; i < 8; ++i) {
        double weight = 1;
        for (int axis = 0; axis < 3; ++axis) weight *= (i >> axis & 1) != 0 ? uvw[axis] : 1 - uvw[axis];
        sum += weight * cells.points[all[cell][i]];
      }
      return sum;
    };
    for (std::size_t node = 0; node < 125; ++node) {
      const std::array<std::size_t, 3> n = {node % 5, node / 5 % 5, node / 25};
      const Vec3 uvw(kNodes[n[0]], kNodes[n[1]], kNodes[n[2]]);
      Mat3 jacobian;
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 step = kStep * Vec3::Unit(axis);
        jacobian.col(axis) =
            (8 * (at(uvw + step) - at(uvw - step)) - (at(uvw + 2 * step) - at(uvw - 2 * step))) / (12 * kStep);
      }
      volume += kWeights[n[0]] * kWeights[n[1]] * kWeights[n[2]] * jacobian.determinant();
    }
  }
  return volume;
}

TEST(BezierCells, OfRegularCellsAreTheirLimit) {
  const auto solid = prepare_solid(oracle::box_mesh(4, 4, 4));
  const BezierCells cells = bezier_cells(*solid, 0);
  ASSERT_EQ(cells.cell_orders.size(), solid->cell_count()) << "without cuts each limit cell is one";
  const auto all = cells_of(cells);
  std::size_t compared = 0;
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> parameter(0, 1);
  for (const LimitCellId cell : solid->cells()) {
    if (solid->cell_class(cell) != CellClass::kRegular) continue;
    ASSERT_EQ(cells.cell_orders[static_cast<std::size_t>(cell)], 3);
    for (int i = 0; i < 20; ++i, ++compared) {
      const Vec3 uvw(parameter(random), parameter(random), parameter(random));
      const Vec3 expected = evaluator.geo({cell, uvw});
      EXPECT_LT((position_in(cells, all[static_cast<std::size_t>(cell)], uvw) - expected).norm(), 1e-13);
    }
  }
  EXPECT_GT(compared, 0u);
}

/// Cut into eight again and again, cells hold the limit of each tiny mesh: every point of one lies where the limit has
/// it, and the plain ones vanish.
TEST(BezierCells, FillTheLimitOfIrregularMeshes) {
  for (const char* name : {"single_hex", "hex_wedge_tet", "single_wedge"}) {
    SCOPED_TRACE(name);
    const auto solid = prepare_solid(oracle::tiny_mesh(name));
    const double limit = solid->summary().deviation.limit_volume_mm3;
    std::array<double, 2> error{};
    for (const int levels : {1, 3}) {
      const BezierCells cells = bezier_cells(*solid, levels);
      error[levels == 3] = std::abs(volume_of(cells) / limit - 1);
      EXPECT_EQ(cells.control_cells.size(), cells.cell_orders.size());
      EXPECT_TRUE(cells.cell_regions.empty());
    }
    EXPECT_LT(error[1], 1e-3);
    EXPECT_LE(error[1], error[0] / 3 + 1e-6);
  }
}

/// Each cut leaves three patches of a line cell, and one box at the line.
TEST(BezierCells, OfALineCellAreThreePatchesForEachCut) {
  const auto solid = prepare_solid(oracle::tiny_mesh("single_wedge"));
  const SolidSummary& summary = solid->summary();
  ASSERT_GT(summary.line_cells, 0u);
  for (int levels = 0; levels < 4; ++levels) {
    const BezierCells cells = bezier_cells(*solid, levels);
    const auto plain = static_cast<std::size_t>(std::ranges::count(cells.cell_orders, 1));
    if (levels == 0 || summary.vertex_cells == 0) {
      EXPECT_EQ(plain, summary.line_cells + summary.vertex_cells);
    }
    if (summary.vertex_cells == 0) {
      EXPECT_EQ(cells.cell_orders.size(),
                summary.regular_cells + summary.line_cells * (3u * static_cast<unsigned>(levels) + 1));
    }
  }
}

/// Faces between cells are shared: in a box of regular size without cuts a face is of one cell at the boundary alone.
TEST(BezierCells, ShareThePointsOfCommonFaces) {
  const BezierCells cells = bezier_cells(oracle::box_mesh(3, 2, 2), 0);
  std::map<std::array<std::uint32_t, 4>, int> faces;
  std::size_t begin = 0;
  for (const std::uint8_t order : cells.cell_orders) {
    const std::size_t n = order, side = n + 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const std::size_t end : {std::size_t{0}, n}) {
        std::array<std::uint32_t, 4> corners{};
        for (std::size_t c = 0; c < 4; ++c) {
          std::array<std::size_t, 3> at{};
          at[axis] = end;
          at[(axis + 1) % 3] = (c & 1) * n;
          at[(axis + 2) % 3] = (c >> 1) * n;
          corners[c] = cells.cell_points[begin + at[0] + side * (at[1] + side * at[2])];
        }
        std::ranges::sort(corners);
        ++faces[corners];
      }
    }
    begin += side * side * side;
  }
  EXPECT_EQ(faces.size(), 52u);
  EXPECT_EQ(std::ranges::count_if(faces, [](const auto& face) { return face.second == 1; }), 32);
}

TEST(BezierCells, OfRegionsHavePointsOfTheirOwn) {
  ControlMesh mesh = oracle::box_mesh(2, 1, 1);
  const std::size_t together = bezier_cells(mesh, 0).points.size();
  mesh.cell_region_names = {"a", "b"};
  mesh.cell_regions = {0, 1};
  const BezierCells cells = bezier_cells(mesh, 0);
  EXPECT_GT(cells.points.size(), together);
  EXPECT_EQ(cells.cell_regions.size(), cells.cell_orders.size());
  EXPECT_TRUE(std::ranges::count(cells.cell_regions, 1) > 0);
}

TEST(BezierCells, StopWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const auto solid = prepare_solid(oracle::box_mesh(1, 1, 1));
  EXPECT_THROW(bezier_cells(*solid, 0, cancel), Error);
}

}  // namespace
}  // namespace ccslice
