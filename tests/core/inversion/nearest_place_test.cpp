// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/nearest_place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(NearestPlace, IsOnTheFaceTheEdgeOrTheCorner) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  const Acceptance acceptance(*solid, 1e-9);
  for (const auto& [point, place] : {std::pair(Vec3(-2, 3, 4), Vec3(0, 0.3, 0.4)),
                                     {Vec3(-2, 13, 4), Vec3(0, 1, 0.4)},
                                     {Vec3(-2, 13, 15), Vec3(0, 1, 1)},
                                     {Vec3(2, 3, 4), Vec3(0.2, 0.3, 0.4)}}) {
    for (const Vec3& start : {Vec3(0.5, 0.5, 0.5), Vec3(1, 0, 0), Vec3(0, 1, 1)}) {
      const NewtonResult found = nearest_in_cell(evaluator, LimitCellId{0}, start, point, acceptance);
      EXPECT_LT((found.uvw - place).norm(), 1e-7) << point.transpose();
      EXPECT_EQ(found.accepted, point.x() > 0);
    }
  }
}

/// Just off the smooth edges of a lone cube, where two columns of the Jacobian are parallel: the nearest place is on a
/// face, from where the way to the point is perpendicular, or on an edge between two.
TEST(NearestPlace, IsTheFootOfThePerpendicularBesideSmoothEdges) {
  const auto solid = prepare_solid(oracle::box_mesh(1, 1, 1));
  LimitEvaluator evaluator(*solid);
  const Acceptance acceptance(*solid, 1e-6);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 400; ++i) {
    const double off_mm = std::pow(10, -6 + 4 * unit(random));
    const LimitCellId cell{static_cast<std::uint32_t>(random() % solid->cell_count())};
    // On the face u = 0 or 1, whichever is on the boundary, many of them near an edge of the cube.
    if (!(solid->boundary_sides(cell) & 3)) continue;
    CellParam at{
        cell, Vec3(solid->boundary_sides(cell) & 1 ? 0 : 1, 1e-4 + 0.9999 * std::pow(unit(random), 3), unit(random))};
    const bool high_v = solid->boundary_sides(cell) & 8;
    if (high_v) at.uvw[1] = 1 - at.uvw[1];
    const LimitSample sample = evaluator.sample(at);
    Vec3 normal = sample.jacobian.col(1).cross(sample.jacobian.col(2)).normalized();
    if (normal.dot(sample.position - Vec3(5, 5, 5)) < 0) normal = -normal;
    const Vec3 point = sample.position + off_mm * normal;
    const NewtonResult found = nearest_in_cell(evaluator, cell, Vec3(0.5, 0.5, 0.5), point, acceptance);
    EXPECT_NEAR(found.residual_mm, off_mm, 1e-9 + 1e-6 * off_mm);
    EXPECT_LT((evaluator.geo({cell, found.uvw}) - sample.position).norm(), 1e-5 * off_mm + 1e-8) << at.uvw.transpose();
  }
}

/// Off by up to a tenth of a cell, where surfaces bend so much that steps without lambda would lead to and fro, and
/// from starts on irregular lines and corners, where the Jacobian points elsewhere: the same place from any start.
TEST(NearestPlace, IsTheSameFromAnyStart) {
  std::size_t tried = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    if (solid->summary().folding_cells > 0) continue;
    LimitEvaluator evaluator(*solid);
    const Acceptance acceptance(*solid, 1e-6);
    for (LimitCellId cell; cell < solid->cell_count(); cell += 5) {
      for (int side = 0; side < 6; ++side) {
        if (!(solid->boundary_sides(cell) >> side & 1)) continue;
        Vec3 uvw(0.3, 0.4, 0.35);
        uvw[side / 2] = side % 2;
        const LimitSample sample = evaluator.sample({cell, uvw});
        const Vec3 across = sample.jacobian.col((side / 2 + 1) % 3).cross(sample.jacobian.col((side / 2 + 2) % 3));
        for (const double off_mm : {1e-3, 0.03, 0.3, 1.0}) {
          const Vec3 point = sample.position + (side % 2 == 1 ? off_mm : -off_mm) * across.normalized();
          double least = off_mm, most = 0;
          for (const Vec3& start : {Vec3(0.5, 0.5, 0.5), Vec3(0, 0, 0), Vec3(1, 1, 0), Vec3(0.2, 0.9, 1)}) {
            const NewtonResult found = nearest_in_cell(evaluator, cell, start, point, acceptance);
            least = std::min(least, found.residual_mm);
            most = std::max(most, found.residual_mm);
          }
          ++tried;
          EXPECT_LE(most, least * (1 + 1e-6)) << name << ", cell " << cell << ", side " << side << ", " << off_mm;
        }
      }
    }
  }
  EXPECT_GT(tried, 500u);
}

TEST(NearestPlace, NeverLeavesTheCellAndNeverGetsFarther) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    const Acceptance acceptance(*solid, 1e-9);
    for (LimitCellId c; c < solid->cell_count(); c += 3) {
      for (const Vec3& far : {Vec3(100, 0, 0), Vec3(-50, 80, -20), Vec3(15, 15, 15)}) {
        const Vec3 start(0.375, 0.625, 0);
        const NewtonResult result = nearest_in_cell(evaluator, c, start, far, acceptance);
        EXPECT_TRUE((result.uvw.array() >= 0).all() && (result.uvw.array() <= 1).all()) << name;
        EXPECT_LE(result.residual_mm, (evaluator.geo({c, start}) - far).norm()) << name;
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
