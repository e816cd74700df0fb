// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/algorithm1.h"

#include <gtest/gtest.h>

namespace ccslice::oracle {
namespace {

/// A row of cubes [i, i + 1] x [0, 1]^2, bent: z = w + 0.2 x^2.
class BentRow final : public Algorithm1Solid {
 public:
  explicit BentRow(std::uint32_t cells) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      const double low = 0.2 * i * i, high = 1 + 0.2 * (i + 1) * (i + 1);
      corners_.push_back(Box3(Vec3(i, 0, low), Vec3(i + 1, 1, high)));
      rings_.push_back(Box3(Vec3(i - 1.0, -1, low - 1), Vec3(i + 2, 2, high + 1)));
    }
  }
  std::span<const Box3> ring_boxes() const override { return rings_; }
  std::span<const Box3> corner_boxes() const override { return corners_; }
  Vec3 geo(const CellParam& at) override {
    const double x = at.cell + at.uvw.x();
    return {x, at.uvw.y(), at.uvw.z() + 0.2 * x * x};
  }
  void geo_and_jacobian(const CellParam& at, Vec3& position, Mat3& jacobian) override {
    position = geo(at);
    jacobian.setIdentity();
    jacobian(2, 0) = 0.4 * position.x();
  }

 private:
  std::vector<Box3> rings_, corners_;
};

TEST(Algorithm1, FindsTheCellAndParameterOfAPoint) {
  BentRow row(4);
  Algorithm1 algorithm(row, {.threshold_mm = 1e-9});
  for (const CellParam& at : {CellParam{LimitCellId{0}, {0.1, 0.2, 0.3}}, CellParam{LimitCellId{2}, {0.9, 0.01, 0.99}},
                              CellParam{LimitCellId{3}, {0.5, 1, 0}}}) {
    const auto found = algorithm.invert(row.geo(at));
    ASSERT_TRUE(found);
    EXPECT_EQ(found->cell, at.cell);
    EXPECT_LT((found->uvw - at.uvw).norm(), 1e-8);
  }
  EXPECT_FALSE(algorithm.invert({2, 1.5, 2}));
  EXPECT_FALSE(algorithm.invert({20, 0, 0}));
}

TEST(Algorithm1, ReusesNeighboursWithinACellAndSearchesAcross) {
  BentRow row(2);
  Algorithm1 algorithm(row, {.threshold_mm = 1e-9});
  std::vector<Vec3> points;
  for (int i = 0; i < 10; ++i) points.push_back(row.geo({LimitCellId(i / 5), {0.1 + 0.2 * (i % 5), 0.5, 0.5}}));
  std::vector<std::optional<CellParam>> line(points.size());
  algorithm.invert_line(points, std::vector<bool>(points.size(), true), {}, line);
  EXPECT_EQ(algorithm.full_inversions(), 2u);
  EXPECT_EQ(algorithm.coherent_inversions(), 8u);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(line[i]->cell, LimitCellId(i / 5));
}

}  // namespace
}  // namespace ccslice::oracle
