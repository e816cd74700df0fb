// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(CellParts, HoldEveryPointOfTheirCell) {
  constexpr unsigned kPartsSeed = 29;
  std::mt19937 random(kPartsSeed);
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 20);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    PatchBuilder builder(solid->data(), kPositionDimension);
    for (const PartSizes& sizes : {PartSizes{2, 1}, PartSizes{3, 2}}) {
      for (int i = 0; i < 30; ++i) {
        const LimitCellId cell{static_cast<std::uint32_t>(random() % solid->cell_count())};
        const CellMap map = solid->index().cell_maps[cell];
        CellHulls parts;
        parts.start_cell();
        append_parts(map, solid->data().cells[cell], sizes, builder, parts);
        parts.finish();
        EXPECT_GT(parts.size(), 1u);
        EXPECT_EQ(parts.size(), part_count(solid->data().cells[cell], sizes, builder)) << name << ", cell " << cell;
        for (int k = 0; k < 20; ++k) {
          Vec3 uvw(u(random), u(random), u(random));
          for (int a = 0; a < k % 4; ++a) uvw[a] = std::exp2(-exponent(random));
          EXPECT_TRUE(parts.may_hold(LimitCellId{0}, map(evaluator.geo({cell, uvw})), Vec3::Zero()))
              << name << ", seed " << kPartsSeed << ", cell " << cell << " at " << uvw.transpose();
        }
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
