// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/irregular_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(IrregularLines, ARegularSolidHasNone) {
  ControlMesh mesh = oracle::box_mesh(2, 3, 2);
  oracle::sharpen_by_cells(mesh, 1);
  EXPECT_TRUE(irregular_lines(*LimitSolid::prepare(mesh)).empty());
}

TEST(IrregularLines, AreEdgesOfTheirCells) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = LimitSolid::prepare(mesh);
    const std::vector<IrregularLine> lines = irregular_lines(*solid);
    EXPECT_EQ(lines.size(), solid->summary().line_cells + 3 * solid->summary().vertex_cells) << name;
    for (const IrregularLine& line : lines) {
      EXPECT_NE(solid->cell_class(line.cell), CellClass::kRegular) << name;
      EXPECT_EQ((line.to - line.from).cwiseAbs().sum(), 1.0) << name;
      for (const Vec3& end : {line.from, line.to}) {
        for (int a = 0; a < 3; ++a) EXPECT_TRUE(end[a] == 0 || end[a] == 1) << name;
      }
    }
  }
}

// Five sectors round the z axis: the axis is the only extraordinary edge, and by symmetry stays where it is.
TEST(IrregularLines, FollowAnExtraordinaryEdge) {
  const auto solid = LimitSolid::prepare(oracle::fan_mesh(5, 3, 4));
  LimitEvaluator evaluator(*solid);
  const Box3& box = solid->summary().bounding_box;
  double length = 0;
  for (const IrregularLine& line : irregular_lines(*solid)) {
    const Vec3 from = evaluator.geo({line.cell, line.from}), to = evaluator.geo({line.cell, line.to});
    const Vec3 middle = evaluator.geo({line.cell, 0.5 * (line.from + line.to)});
    if (std::max(std::hypot(from.x(), from.y()), std::hypot(to.x(), to.y())) > 1e-6) continue;
    EXPECT_LT(std::hypot(middle.x(), middle.y()), 1e-6);
    length += std::abs(to.z() - from.z());
  }
  EXPECT_NEAR(length, 5 * box.sizes().z(), 1e-6) << "once for each cell that shares it, from bottom to top";
}

class PointsOfALine : public testing::Test {
 protected:
  PointsOfALine() : solid_(LimitSolid::prepare(oracle::tiny_mesh("box_3"))), evaluator_(*solid_) {
    line_ = irregular_lines(*solid_).front();
  }

  std::vector<Vec3> points(double spacing_mm) {
    std::vector<Vec3> points;
    append_points(line_, spacing_mm, evaluator_, points);
    return points;
  }

  std::shared_ptr<const LimitSolid> solid_;
  LimitEvaluator evaluator_;
  IrregularLine line_;
};

TEST_F(PointsOfALine, ReachFromEndToEnd) {
  for (const double spacing : {1e3, 1.0, 0.1}) {
    const std::vector<Vec3> found = points(spacing);
    EXPECT_EQ(found.front(), evaluator_.geo({line_.cell, line_.from}));
    EXPECT_EQ(found.back(), evaluator_.geo({line_.cell, line_.to}));
  }
  EXPECT_EQ(points(1e3).size(), 2u);
}

TEST_F(PointsOfALine, LieAboutTheSpacingApart) {
  const std::vector<Vec3> found = points(0.3);
  EXPECT_GT(found.size(), 4u);
  for (std::size_t p = 1; p < found.size(); ++p) EXPECT_LT((found[p] - found[p - 1]).norm(), 2 * 0.3);
}

TEST_F(PointsOfALine, AreBounded) { EXPECT_LE(points(1e-9).size(), 257u); }

TEST_F(PointsOfALine, AreAppended) {
  std::vector<Vec3> all = {Vec3(1, 2, 3)};
  append_points(line_, 1e3, evaluator_, all);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0], Vec3(1, 2, 3));
}

}  // namespace
}  // namespace ccslice
