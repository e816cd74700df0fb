// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/part_trees.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr unsigned kPartsSeed = 23;
constexpr double kPartsDistance = 2e-3;

Vec3 random_direction_from(std::mt19937& random) {
  std::normal_distribution<double> gauss;
  return Vec3(gauss(random), gauss(random), gauss(random)).normalized();
}

// Every third place lies beside a line, every ninth beside a corner. Points just off the cell have its parts divided.
TEST(PartTrees, NeverRuleOutWhatSomePlaceOfTheCellHas) {
  std::mt19937 random(kPartsSeed);
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 20);
  std::vector<oracle::TinyMesh> meshes = oracle::tiny_meshes();
  meshes.push_back({"crossed valleys", oracle::crossed_valleys()});
  meshes.push_back({"folding box", oracle::folding_box_mesh()});
  meshes.back().mesh.allow_folds = true;
  for (const auto& [name, mesh] : meshes) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    PartTrees parts(*solid, kPartsDistance);
    for (int i = 0; i < 400; ++i) {
      CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % std::min(4u, solid->cell_count()))},
                   Vec3(u(random), u(random), u(random))};
      for (int a = 0; a < (i % 3 ? 0 : i % 9 ? 2 : 3); ++a) at.uvw[a] = std::exp2(-exponent(random));
      if (i % 2 == 0) at.uvw[i / 2 % 3] = i / 6 % 2;
      const Vec3 place = evaluator.geo(at);
      parts.refine(at.cell, place + 3 * kPartsDistance * random_direction_from(random));
      EXPECT_TRUE(parts.may_hold(at.cell, place + 0.999 * kPartsDistance * random_direction_from(random)))
          << name << ", seed " << kPartsSeed << ", cell " << at.cell << " at " << at.uvw.transpose();
    }
    EXPECT_GT(parts.size(), 0u);
  }
}

// A cell's neighbours hold points that its own box holds too.
TEST(PartTrees, RuleOutWhatLiesALittleOffTheCell) {
  std::mt19937 random(kPartsSeed);
  std::uniform_real_distribution<double> u(0, 1);
  for (const char* name : {"cross_of_seven", "edge_valence_8", "vertex_link_icosahedron"}) {
    const auto solid = prepare_solid(oracle::tiny_mesh(name));
    LimitEvaluator evaluator(*solid);
    PartTrees parts(*solid, kPartsDistance);
    int off = 0, ruled_out = 0;
    for (int i = 0; i < 1000; ++i) {
      // In cell 0 well away from its faces, sought in another.
      const Vec3 uvw = Vec3::Constant(0.1) + 0.8 * Vec3(u(random), u(random), u(random));
      const Vec3 point = evaluator.geo({LimitCellId{0}, uvw});
      const LimitCellId other{static_cast<std::uint32_t>(1 + random() % std::min(7u, solid->cell_count() - 1))};
      for (int asked = 0; asked < 3 && parts.may_hold(other, point); ++asked) parts.refine(other, point);
      ++off;
      ruled_out += !parts.may_hold(other, point);
    }
    EXPECT_GE(ruled_out, 0.99 * off) << name << ", seed " << kPartsSeed;
  }
}

TEST(PartTrees, ForgetRatherThanGrow) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  oracle::jitter(mesh, 1, kPartsSeed);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  PartTrees parts(*solid, 1e-6);
  std::mt19937 random(kPartsSeed);
  std::uniform_real_distribution<double> u(0, 1);
  std::size_t most = 0, before = 0;
  bool forgot = false;
  for (int i = 0; i < 20'000; ++i) {
    const CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % solid->cell_count())},
                       Vec3(u(random), u(random), i % 2)};
    parts.refine(at.cell, evaluator.geo(at));
    forgot |= parts.size() < before;
    before = parts.size();
    most = std::max(most, before);
  }
  EXPECT_TRUE(forgot);
  EXPECT_LE(most, PartTrees::kMostNodes);
}

TEST(PartTrees, StandPointsThatArentFinite) {
  const auto solid = prepare_solid(oracle::tiny_mesh("cross_of_seven"));
  PartTrees parts(*solid, kPartsDistance);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double far : {1e300, infinity, -infinity, std::numeric_limits<double>::quiet_NaN()}) {
    for (int i = 0; i < 3; ++i) parts.refine(LimitCellId{0}, Vec3(far, 0, 0));
    EXPECT_NO_FATAL_FAILURE((void)parts.may_hold(LimitCellId{0}, Vec3(far, 0, 0)));
  }
  for (int i = 0; i < 3; ++i) parts.refine(LimitCellId{0}, Vec3(1e9, 0, 0));
  EXPECT_FALSE(parts.may_hold(LimitCellId{0}, Vec3(1e9, 0, 0)));
}

}  // namespace
}  // namespace ccslice
