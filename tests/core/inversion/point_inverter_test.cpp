// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/point_inverter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(PointInverter, FindsEveryEvaluatedPointOfTheCatalogue) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 20);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = LimitSolid::prepare(mesh);
    PointInverter inverter(*solid);
    LimitEvaluator evaluator(*solid);
    std::uniform_int_distribution<std::uint32_t> cell(0, solid->cell_count() - 1);
    for (int i = 0; i < 300; ++i) {
      CellParam at{cell(random), Vec3(u(random), u(random), u(random))};
      // Every third point lies beside a line, every ninth beside a corner.
      for (int a = 0; a < (i % 3 ? 0 : i % 9 ? 2 : 3); ++a) at.uvw[a] = std::exp2(-exponent(random));
      const Vec3 point = evaluator.geo(at);
      const auto found = inverter.invert(point);
      ASSERT_TRUE(found) << name << " cell " << at.cell << " at " << at.uvw.transpose();
      EXPECT_LE(found->residual_mm, 1e-6) << name << " cell " << at.cell << " at " << at.uvw.transpose();
      EXPECT_LE((evaluator.geo(found->at) - point).norm(), 1.01e-6) << name;
    }
  }
}

TEST(PointInverter, UsesAHintInTheSameCell) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = LimitSolid::prepare(mesh);
  PointInverter inverter(*solid);
  const auto first = inverter.invert(Vec3(15, 15, 15));
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->full);
  const auto second = inverter.invert(Vec3(15.1, 15, 15), first->at);
  ASSERT_TRUE(second);
  EXPECT_FALSE(second->full);
  const auto third = inverter.invert(Vec3(25, 5, 15), first->at);
  ASSERT_TRUE(third);
  EXPECT_TRUE(third->full);
  EXPECT_NE(third->at.cell, first->at.cell);
}

TEST(PointInverter, TakesTheNearestParameterJustOutsideAndNothingFarther) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = LimitSolid::prepare(mesh);
  InversionOptions options;
  options.outside_mm = 0.01;
  PointInverter inverter(*solid, options);
  const auto near = inverter.invert(Vec3(-0.005, 5, 5));
  ASSERT_TRUE(near);
  EXPECT_NEAR(near->residual_mm, 0.005, 1e-9);
  EXPECT_FALSE(inverter.invert(Vec3(-0.02, 5, 5)));
  EXPECT_FALSE(inverter.invert(Vec3(1000, 5, 5)));
  EXPECT_FALSE(inverter.invert(Vec3(-0.02, 5, 5), near->at));
}

TEST(PointInverter, GivesFoldedPlacesToTheLowestCellWhateverTheHint) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  mesh.allow_folds = true;
  for (Vec3& p : mesh.positions) {
    if ((p - Vec3::Constant(20)).norm() < 1e-9) p += Vec3(80, 0, 0);
  }
  const auto solid = LimitSolid::prepare(mesh);
  ASSERT_GT(solid->summary().folding_cells, 0u);
  PointInverter inverter(*solid);
  const Vec3 point = solid->summary().folds.front().position;
  const auto plain = inverter.invert(point);
  ASSERT_TRUE(plain);
  for (std::uint32_t c = 0; c < solid->cell_count(); ++c) {
    const auto hinted = inverter.invert(point, CellParam{c, Vec3::Constant(0.5)});
    ASSERT_TRUE(hinted);
    EXPECT_EQ(hinted->at.cell, plain->at.cell);
    EXPECT_EQ(hinted->at.uvw, plain->at.uvw);
  }
}

TEST(PointInverter, StandsPointsThatArentFinite) {
  const auto solid = LimitSolid::prepare(oracle::box_mesh(2, 2, 2));
  PointInverter inverter(*solid);
  EXPECT_FALSE(inverter.invert(Vec3(std::nan(""), 0, 0)));
  EXPECT_FALSE(inverter.invert(Vec3(0, INFINITY, 0)));
}

}  // namespace
}  // namespace ccslice
