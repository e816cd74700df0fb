// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/mid_node_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace ccslice {
namespace {

using testing::ElementsAre;

const std::vector<Vec3> kCube = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0},
                                 {0, 0, 2}, {2, 0, 2}, {2, 2, 2}, {0, 2, 2}};

TEST(MidNodePlaces, AreTheMiddlesOfEdgesFacesAndCells) {
  const std::vector<Vec3> of_tet =
      middles(CellKind::kTet, std::vector<Vec3>{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}});
  EXPECT_THAT(of_tet,
              ElementsAre(Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)));
  EXPECT_EQ(middles(CellKind::kWedge, std::vector<Vec3>(6, Vec3::Zero())).size(), 12u);
  const std::vector<Vec3> of_cube = middles(CellKind::kHex, kCube);
  ASSERT_EQ(of_cube.size(), 19u);
  EXPECT_EQ(of_cube[3], Vec3(0, 1, 0)) << "the edge from corner 3 to 0";
  EXPECT_EQ(of_cube[12], Vec3(0, 1, 1)) << "the face u = 0";
  EXPECT_EQ(of_cube[17], Vec3(1, 1, 2)) << "the face w = 1";
  EXPECT_EQ(of_cube[18], Vec3(1, 1, 1));
}

/// A quadratic map of a cube has the bent middles just there.
TEST(MidNodePlaces, FollowTheNodesOfEdges) {
  const auto bent = [](const Vec3& p) {
    return Vec3(p.x() + p.y() * p.y(), p.y() + p.z() * p.z(), p.z() - p.x() * p.x());
  };
  std::vector<Vec3> corners, of_edges;
  for (const Vec3& corner : kCube) corners.push_back(bent(corner));
  const std::vector<Vec3> straight = middles(CellKind::kHex, kCube);
  for (std::size_t edge = 0; edge < 12; ++edge) of_edges.push_back(bent(straight[edge]));
  std::vector<Vec3> found = middles(CellKind::kHex, corners);
  bend_middles(CellKind::kHex, corners, of_edges, found);
  for (std::size_t place = 12; place < 19; ++place) {
    EXPECT_LT((found[place] - bent(straight[place])).norm(), 1e-14) << place;
  }
}

double cost_of(const Eigen::MatrixXd& costs, const std::vector<std::size_t>& columns) {
  double sum = 0;
  for (Eigen::Index row = 0; row < costs.rows(); ++row) {
    sum += costs(row, static_cast<Eigen::Index>(columns[static_cast<std::size_t>(row)]));
  }
  return sum;
}

TEST(CheapestColumns, CostNoMoreThanAnyOthers) {
  constexpr std::uint32_t kSeed = 20261128;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int> cost(-9, 9), rows(1, 4), more(0, 2);
  for (int round = 0; round < 500; ++round) {
    const int height = rows(random), width = height + more(random);
    const Eigen::MatrixXd costs = Eigen::MatrixXd::NullaryExpr(height, width, [&] { return 1.0 * cost(random); });
    const std::vector<std::size_t> found = cheapest_columns(costs);
    std::vector<std::size_t> columns(static_cast<std::size_t>(width));
    std::iota(columns.begin(), columns.end(), std::size_t{0});
    ASSERT_TRUE(std::ranges::is_permutation(std::vector(columns), [&] {
      std::vector<std::size_t> all = found;
      for (const std::size_t column : columns) {
        if (std::ranges::find(found, column) == found.end()) all.push_back(column);
      }
      return all;
    }()));
    double least = std::numeric_limits<double>::infinity();
    do least = std::min(least, cost_of(costs, columns));
    while (std::ranges::next_permutation(columns).found);
    ASSERT_EQ(cost_of(costs, found), least) << "seed " << kSeed << ", round " << round << "\n" << costs;
  }
}

TEST(CheapestColumns, EndForAnyNumbers) {
  const Eigen::MatrixXd costs = Eigen::MatrixXd::Constant(3, 4, std::numeric_limits<double>::quiet_NaN());
  std::vector<std::size_t> columns = cheapest_columns(costs);
  std::ranges::sort(columns);
  EXPECT_EQ(std::ranges::adjacent_find(columns), columns.end());
  EXPECT_TRUE(cheapest_columns(Eigen::MatrixXd(0, 3)).empty());
}

}  // namespace
}  // namespace ccslice
