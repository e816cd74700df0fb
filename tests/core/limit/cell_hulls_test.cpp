// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_hulls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/limit/cell_index.h"
#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(CellHulls, HoldEveryPointOfTheirCellsAndFewOthers) {
  constexpr unsigned kSeed = 3;
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  const auto solid = prepare_solid(mesh);
  const CellIndex& index = solid->index();
  ASSERT_GT(index.hulls_near_folds.size(), 0u);
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 20);
  int others_by_box = 0, others_by_hull = 0;
  for (int i = 0; i < 20000; ++i) {
    CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % solid->cell_count())},
                 Vec3(u(random), u(random), u(random))};
    for (int a = 0; a < i % 4; ++a) at.uvw[a] = std::exp2(-exponent(random));
    const Vec3 point = evaluator.geo(at);
    EXPECT_TRUE(index.hulls_near_folds.may_hold(at.cell, index.cell_maps[at.cell](point), Vec3::Zero()))
        << "seed " << kSeed << ", cell " << at.cell << " at " << at.uvw.transpose();
    if (!index.fold_boxes.any_at(point, 0)) continue;
    index.cell_boxes.visit_at(point, 0, [&](std::uint32_t item) {
      const LimitCellId cell{item};
      others_by_box += cell != at.cell;
      others_by_hull +=
          cell != at.cell && index.hulls_near_folds.may_hold(cell, index.cell_maps[cell](point), Vec3::Zero());
    });
  }
  EXPECT_LT(others_by_hull, 0.7 * others_by_box);
}

TEST(CellHulls, AreAsCloseAsTheirMemoryAllows) {
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  LimitSolid::Data data = prepare_solid(mesh)->data();
  const auto bytes_within = [&](std::size_t most_bytes) {
    data.hulls_near_folds = {};
    find_hulls_near_folds(most_bytes, {}, data);
    return data.hulls_near_folds.memory_bytes();
  };
  const std::size_t closest = data.hulls_near_folds.memory_bytes();
  EXPECT_EQ(bytes_within(closest), closest);
  const std::size_t fewer = bytes_within(closest - 1);
  EXPECT_LT(fewer, closest);
  EXPECT_GT(fewer, closest / 4);
  EXPECT_EQ(bytes_within(fewer - 1), 0u);
}

}  // namespace
}  // namespace ccslice
