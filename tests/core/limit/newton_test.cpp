// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/newton.h"

#include <gtest/gtest.h>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(Newton, ArrivesInOneStepInALinearCell) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  const NewtonResult result =
      newton_in_cell(evaluator, LimitCellId{0}, Vec3(0.5, 0.5, 0.5), Vec3(1, 9, 4), Acceptance(*solid, 1e-9));
  EXPECT_LT((result.uvw - Vec3(0.1, 0.9, 0.4)).norm(), 1e-12);
  EXPECT_EQ(result.steps, 1);
}

TEST(Newton, SlidesAlongTheFaceToTheNearestParameter) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  const NewtonResult face =
      newton_in_cell(evaluator, LimitCellId{0}, Vec3(0.5, 0.5, 0.5), Vec3(-2, 3, 4), Acceptance(*solid, 1e-9));
  EXPECT_LT((face.uvw - Vec3(0, 0.3, 0.4)).norm(), 1e-12);
  EXPECT_NEAR(face.residual_mm, 2, 1e-12);
  const NewtonResult corner =
      newton_in_cell(evaluator, LimitCellId{0}, Vec3(0.5, 0.5, 0.5), Vec3(-2, 13, 15), Acceptance(*solid, 1e-9));
  EXPECT_LT((corner.uvw - Vec3(0, 1, 1)).norm(), 1e-12);
}

TEST(Newton, NeverLeavesTheCell) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    for (LimitCellId c; c < solid->cell_count(); c += 3) {
      for (const Vec3& far : {Vec3(100, 0, 0), Vec3(-50, 80, -20), Vec3(15, 15, 15)}) {
        const NewtonResult result =
            newton_in_cell(evaluator, c, Vec3(0.375, 0.625, 0.125), far, Acceptance(*solid, 1e-9));
        EXPECT_TRUE((result.uvw.array() >= 0).all() && (result.uvw.array() <= 1).all()) << name;
        EXPECT_TRUE(std::isfinite(result.residual_mm)) << name;
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
