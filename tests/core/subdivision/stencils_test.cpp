// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/stencils.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

TEST(Stencils, AreTheRowsOfAMatrix) {
  constexpr std::uint32_t kSeed = 20261123, kRows = 9, kPoints = 7;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Stencils stencils;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(kRows, kPoints);
  for (std::uint32_t r = 0; r < kRows; ++r) {
    std::vector<std::pair<std::uint32_t, double>> row;
    for (std::uint32_t p = 0; p < kPoints; ++p) {
      if (random() % 3 == 0) row.emplace_back(p, matrix(r, p) = unit(random));
    }
    stencils.append(row);
  }
  EXPECT_EQ(stencils.rows(), kRows);
  for (const std::size_t dimension : {3, 4, 5}) {
    using Points = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Points points(kPoints, dimension), out = Points::Constant(4, dimension, 99);
    for (double& x : points.reshaped()) x = unit(random);
    stencils.apply(3, 4, points.data(), dimension, out.data());
    EXPECT_LT((out - matrix.middleRows(3, 4) * points).norm(), 1e-15) << "seed " << kSeed;
  }
}

}  // namespace
}  // namespace ccslice
