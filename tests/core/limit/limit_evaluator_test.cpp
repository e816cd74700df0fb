// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_evaluator.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(LimitEvaluator, ReproducesASharpBoxAndALinearGradient) {
  ControlMesh mesh = oracle::box_mesh(2, 3, 2, 4);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::grade_by_coordinates(mesh);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  std::vector<double> material(3);
  for (const LimitCellId c : solid->cells()) {
    const CellParam at{c, Vec3(0.2, 0.55, 0.9)};
    const Vec3 expected = 4 * (Vec3(c % 2, c / 2 % 3, c / 6) + at.uvw);
    EXPECT_LT((evaluator.geo(at) - expected).norm(), 1e-12);
    EXPECT_LT((evaluator.sample(at).jacobian - 4 * Mat3::Identity()).norm(), 1e-12);
    evaluator.mat(at, material);
    EXPECT_LT((Vec3::Map(material.data()) - expected).norm(), 1e-6);
  }
}

/// Parameters everywhere in a cell, denser towards its corners.
Vec3 random_parameter(std::mt19937& random) {
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 9);
  std::uniform_int_distribution<int> kind(0, 2);
  Vec3 p;
  for (int a = 0; a < 3; ++a) {
    const int k = kind(random);
    const double small = std::exp2(-exponent(random));
    p[a] = k == 0 ? u(random) : k == 1 ? small : 1 - small;
  }
  return p;
}

TEST(LimitEvaluator, JacobianAgreesWithFiniteDifferencesOnTheCatalogue) {
  std::mt19937 random(3);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    std::uniform_int_distribution<std::uint32_t> cell(0, solid->cell_count() - 1);
    for (int i = 0; i < 200; ++i) {
      const CellParam at{LimitCellId{cell(random)}, random_parameter(random)};
      const LimitSample sample = evaluator.sample(at);
      EXPECT_EQ(sample.position, evaluator.geo(at));
      for (int a = 0; a < 3; ++a) {
        // A central difference within the patch that holds the parameter: third-order terms only.
        const double room = std::min(at.uvw[a], 1 - at.uvw[a]);
        const double h = std::min(1e-5, room / 64);
        if (h == 0) continue;
        CellParam low = at, high = at;
        low.uvw[a] -= h;
        high.uvw[a] += h;
        const Vec3 slope = (evaluator.geo(high) - evaluator.geo(low)) / (high.uvw[a] - low.uvw[a]);
        EXPECT_LT((slope - sample.jacobian.col(a)).norm(), 2e-3 * (sample.jacobian.norm() + 1e-3))
            << name << " cell " << at.cell << " at " << at.uvw.transpose() << " axis " << a;
      }
    }
  }
}

TEST(LimitEvaluator, IsContinuousAcrossThePatchesOfACell) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(0, 1);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    for (const LimitCellId c : solid->cells()) {
      if (solid->cell_class(c) == CellClass::kRegular) continue;
      for (const double cut : {0.5, 0.25, 0.75, 0.0625}) {
        CellParam low{c, Vec3(u(random), u(random), u(random))};
        const int axis = static_cast<int>(random() % 3);
        CellParam high = low;
        low.uvw[axis] = std::nextafter(cut, 0.0);
        high.uvw[axis] = cut;
        EXPECT_LT((evaluator.geo(low) - evaluator.geo(high)).norm(), 1e-11) << name << " cell " << c;
      }
    }
  }
}

TEST(LimitEvaluator, CellsMeetAtEverySharedFace) {
  // The corners of all limit cells, evaluated on irregular places too, must form one point per vertex of the refined
  // mesh.
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    std::vector<Vec3> corners;
    for (const LimitCellId c : solid->cells()) {
      for (int j = 0; j < 8; ++j) corners.push_back(evaluator.geo({c, Vec3(j & 1, j >> 1 & 1, j >> 2)}));
    }
    const double diagonal = solid->summary().bounding_box.diagonal().norm();
    std::size_t near = 0, exact = 0;
    for (std::size_t a = 0; a < corners.size(); ++a) {
      for (std::size_t b = a + 1; b < corners.size(); ++b) {
        const double distance = (corners[a] - corners[b]).norm();
        near += distance < 1e-4 * diagonal;
        exact += distance < 1e-11 * diagonal;
      }
    }
    EXPECT_EQ(near, exact) << name;
    EXPECT_TRUE(exact > 0 || solid->cell_count() == 1) << name;
  }
}

TEST(LimitEvaluator, DoesNotDependOnWhatItEvaluatedBefore) {
  const auto solid = prepare_solid(oracle::tiny_mesh("hollow_cube"));
  LimitEvaluator used(*solid);
  std::mt19937 random(5);
  std::uniform_int_distribution<std::uint32_t> cell(0, solid->cell_count() - 1);
  for (int i = 0; i < 3000; ++i) {
    const CellParam at{LimitCellId{cell(random)}, random_parameter(random)};
    const Vec3 warm = used.geo(at);
    if (i % 50 == 0) {
      EXPECT_EQ(LimitEvaluator(*solid).geo(at), warm);
    }
  }
}

/// Levels of lines and vertices in any order. One patch at most is kept: others are built where the last walk ended.
void expect_walks_go_up_again(const LimitSolid& solid) {
  LimitEvaluator used(solid, 1);
  std::mt19937 random(6);
  std::uniform_int_distribution<int> level(0, 12), side(0, 1);
  std::array<int, 3> cells_of_class{};
  for (std::uint32_t cell = 0; cell < solid.cell_count(); cell += 5) {
    ++cells_of_class[static_cast<std::size_t>(solid.cell_class(LimitCellId{cell}))];
    for (int i = 0; i < 40; ++i) {
      Vec3 uvw = random_parameter(random);
      for (int a = 0; a < 3; ++a) {
        uvw[a] = std::ldexp(uvw[a], -level(random));
        if (side(random) == 1) uvw[a] = 1 - uvw[a];
      }
      const CellParam at{LimitCellId{cell}, uvw};
      ASSERT_EQ(used.geo(at), LimitEvaluator(solid, 1).geo(at)) << cell << ": " << uvw.transpose();
    }
  }
  EXPECT_GT(cells_of_class[static_cast<std::size_t>(CellClass::kLine)], 0);
  EXPECT_GT(cells_of_class[static_cast<std::size_t>(CellClass::kVertex)], 0);
}

TEST(LimitEvaluator, WalksDownACellAndUpAgain) {
  ControlMesh mesh = oracle::tiny_mesh("hollow_cube");
  expect_walks_go_up_again(*prepare_solid(mesh));
  mesh.channel_names = {"alone"};  // With its position a point fills a register, which is a way of its own.
  mesh.channel_values.assign(mesh.positions.size(), 1);
  expect_walks_go_up_again(*prepare_solid(mesh));
}

}  // namespace
}  // namespace ccslice
