// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/packed_stencils.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261127, kRows = 9, kPoints = 7;

using Points = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// `columns`: of the matrix; entries stand in the last kPoints of them.
Stencils random_stencils(std::mt19937& random, std::uint32_t columns) {
  constexpr std::array<double, 4> kWeights = {0.25, -0.5, 1.0 / 3, -0.0};
  Stencils stencils;
  for (std::uint32_t r = 0; r < kRows; ++r) {
    std::vector<std::pair<std::uint32_t, double>> row;
    for (std::uint32_t p = columns - kPoints; p < columns; ++p) {
      if (random() % 3 == 0) row.emplace_back(p, kWeights[random() % kWeights.size()]);
    }
    stencils.append(row);
  }
  return stencils;
}

Points random_points(std::mt19937& random, Eigen::Index rows, std::size_t dimension) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Points points(rows, dimension);
  for (double& x : points.reshaped()) x = unit(random);
  return points;
}

// Columns that take two bytes, and such that don't.
TEST(PackedStencils, AreTheSameMatrixToTheLastBit) {
  std::mt19937 random(kSeed);
  for (const std::uint32_t columns : {kPoints, 65'536u, 65'537u}) {
    const Stencils stencils = random_stencils(random, columns);
    const PackedStencils packed(stencils);
    ASSERT_EQ(packed.rows(), kRows);
    for (std::uint32_t r = 0; r < kRows; ++r) {
      std::uint32_t e = stencils.offsets[r];
      packed.for_each(r, [&](std::uint32_t column, double weight) {
        ASSERT_LT(e, stencils.offsets[r + 1]);
        EXPECT_EQ(column, stencils.indices[e]);
        EXPECT_EQ(std::signbit(weight), std::signbit(stencils.weights[e]));
        EXPECT_EQ(weight, stencils.weights[e++]);
      });
      EXPECT_EQ(e, stencils.offsets[r + 1]);
    }
    for (const std::size_t dimension : {3, 4, 5}) {
      const Points points = random_points(random, columns, dimension);
      Points expected(4, dimension), out = Points::Constant(4, dimension, 99);
      stencils.apply(3, 4, points.data(), dimension, expected.data());
      packed.apply(3, 4, points.data(), dimension, out.data());
      EXPECT_EQ(out, expected) << columns;
    }
  }
}

TEST(PackedStencils, MakeChosenRowsAndLayers) {
  std::mt19937 random(kSeed);
  const PackedStencils stencils(random_stencils(random, kPoints));
  for (const std::size_t dimension : {3, 4, 5}) {
    const Points points = random_points(random, kPoints, dimension);
    Points out = Points::Constant(4, dimension, 99), of_chosen = out;
    stencils.apply(3, 4, points.data(), dimension, out.data());
    const std::vector<std::uint32_t> chosen = {6, 3, 3, 5};
    stencils.apply(chosen, points.data(), dimension, of_chosen.data());
    for (const auto& [r, row] : {std::pair(0, 3), {1, 0}, {2, 0}, {3, 2}}) EXPECT_EQ(of_chosen.row(r), out.row(row));
    // Layers come to the same, to the last bit.
    const Points layers = random_points(random, 4 * kPoints, dimension);
    Points of_layers = Points::Constant(4 * 4, dimension, 99);
    stencils.apply_to_layers(3, 4, layers.data(), kPoints, dimension, of_layers.data());
    for (Eigen::Index layer = 0; layer < 4; ++layer) {
      stencils.apply(3, 4, layers.middleRows(layer * kPoints, kPoints).eval().data(), dimension, out.data());
      EXPECT_EQ(of_layers.middleRows(4 * layer, 4), out) << "seed " << kSeed << ", layer " << layer;
    }
    stencils.apply_to_layers(chosen, layers.data(), kPoints, dimension, of_layers.data());
    for (Eigen::Index layer = 0; layer < 4; ++layer) {
      stencils.apply(chosen, layers.middleRows(layer * kPoints, kPoints).eval().data(), dimension, of_chosen.data());
      EXPECT_EQ(of_layers.middleRows(4 * layer, 4), of_chosen) << "seed " << kSeed << ", layer " << layer;
    }
  }
}

TEST(PackedStencils, TakeFourBytesAnEntry) {
  Stencils stencils;
  std::vector<std::pair<std::uint32_t, double>> row;
  for (std::uint32_t p = 0; p < 1000; ++p) row.emplace_back(p, 1.0 / (1 + p % 10));
  for (int r = 0; r < 100; ++r) stencils.append(row);
  EXPECT_LE(PackedStencils(stencils).memory_bytes(), 100 * (1000 * 4 + 4) + 4 + 10 * 8u);
}

// More different weights than two bytes tell apart.
TEST(PackedStencils, KeepAsManyWeightsAsThereAre) {
  constexpr std::uint32_t kWeights = 70'000;
  Stencils stencils;
  std::vector<std::pair<std::uint32_t, double>> row;
  for (std::uint32_t p = 0; p < kWeights; ++p) row.emplace_back(p % 1000, 1.0 + p);
  stencils.append(row);
  std::uint32_t next = 0;
  PackedStencils(stencils).for_each(0, [&](std::uint32_t column, double weight) {
    EXPECT_EQ(column, next % 1000);
    EXPECT_EQ(weight, 1.0 + next++);
  });
  EXPECT_EQ(next, kWeights);
}

}  // namespace
}  // namespace ccslice
