// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kBoxSeed = 20261123;

class CellBoxesTest : public testing::TestWithParam<oracle::TinyMesh> {
 protected:
  CellBoxesTest() : solid_(prepare_solid(GetParam().mesh)), evaluator_(*solid_), random_(kBoxSeed) {}

  Vec3 random_parameter() {
    std::uniform_real_distribution<double> unit(0, 1);
    return {unit(random_), unit(random_), unit(random_)};
  }

  std::shared_ptr<const LimitSolid> solid_;
  LimitEvaluator evaluator_;
  std::mt19937 random_;
};

TEST_P(CellBoxesTest, HoldTheirCellsAndWhatTheirMapsGuess) {
  const LimitSolid::Data& data = solid_->data();
  for (const LimitCellId cell : solid_->cells()) {
    const CellMap map = data.cell_maps[cell];
    for (int k = 0; k < 12; ++k) {
      Vec3 uvw = random_parameter();
      if (k % 2 == 0) uvw = uvw.array().round();  // A corner.
      const Vec3 point = evaluator_.geo({cell, uvw});
      const Box3 box = data.cell_boxes.box(cell);
      ASSERT_LT(box.exteriorDistance(point), 1e-9)
          << "seed " << kBoxSeed << ", cell " << cell << " at " << uvw.transpose();
      ASSERT_TRUE(map.may_hold(map(point), 1e-9))
          << "seed " << kBoxSeed << ", cell " << cell << " at " << uvw.transpose();
    }
  }
}

// They hold the control points of parts of their cells.
TEST_P(CellBoxesTest, AreNotFarLargerThanTheirCells) {
  double of_boxes = 0, of_samples = 0;
  for (const LimitCellId cell : solid_->cells()) {
    Box3 samples;
    for (int k = 0; k < 125; ++k) samples.extend(evaluator_.geo({cell, Vec3(k % 5, k / 5 % 5, k / 25) / 4}));
    of_boxes += solid_->data().cell_boxes.box(cell).diagonal().norm();
    of_samples += samples.diagonal().norm();
  }
  EXPECT_LT(of_boxes, 2 * of_samples);
}

TEST_P(CellBoxesTest, MapsAreToFirstOrderAboutTheMiddle) {
  const LimitSolid::Data& data = solid_->data();
  CellVolumes regular, irregular;
  for (const LimitCellId cell : solid_->cells()) {
    const Vec3 middle = Vec3::Constant(0.5);
    constexpr double kStep = 1e-6;
    Mat3 jacobian;
    for (int a = 0; a < 3; ++a) {
      const Vec3 step = kStep * Vec3::Unit(a);
      jacobian.col(a) = (evaluator_.geo({cell, middle + step}) - evaluator_.geo({cell, middle - step})) / (2 * kStep);
    }
    const CellMap map = data.cell_maps[cell];
    const double rounding = 1e-7 * solid_->summary().bounding_box.diagonal().norm();
    ASSERT_LT((map.middle - evaluator_.geo({cell, middle})).norm(), rounding);
    ASSERT_LT((map.inverse_jacobian * jacobian - Mat3::Identity()).norm(), 1e-5);
    const double volume = jacobian.determinant();
    EXPECT_NEAR(data.volume_mm3(cell), volume, 1e-4 * volume);
    CellVolumes& volumes = solid_->cell_class(cell) == CellClass::kRegular ? regular : irregular;
    volumes = {std::min(volumes.least, volume), std::max(volumes.most, volume)};
  }
  for (const auto& [found, expected] :
       {std::pair(data.regular_volumes, regular), {data.irregular_volumes, irregular}}) {
    EXPECT_NEAR(found.most, expected.most, 1e-4 * expected.most);
    if (expected.most > 0) {
      EXPECT_NEAR(found.least, expected.least, 1e-4 * expected.least);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, CellBoxesTest, testing::ValuesIn(oracle::tiny_meshes()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace ccslice
