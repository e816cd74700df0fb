// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/limit/cell_index.h"
#include "core/limit/limit_evaluator.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr unsigned kDistanceSeed = 19;

Vec3 random_direction_off(std::mt19937& random) {
  std::normal_distribution<double> gauss;
  return Vec3(gauss(random), gauss(random), gauss(random)).normalized();
}

// Every third point lies beside a line, every ninth beside a corner.
CellParam random_place_in(const LimitSolid& solid, int i, std::mt19937& random) {
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 20);
  CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % solid.cell_count())},
               Vec3(u(random), u(random), u(random))};
  for (int a = 0; a < (i % 3 ? 0 : i % 9 ? 2 : 3); ++a) at.uvw[a] = std::exp2(-exponent(random));
  return at;
}

TEST(CellDistance, NeverExceedsWhatSomePlaceOfTheCellHas) {
  std::mt19937 random(kDistanceSeed);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    CellDistance distance(*solid);
    std::uniform_real_distribution<double> exponent(0, 20);
    for (int i = 0; i < 200; ++i) {
      const CellParam at = random_place_in(*solid, i, random);
      const double mm = solid->index().cell_maps[at.cell].thickness_mm() * std::exp2(-exponent(random));
      if (!std::isfinite(mm)) continue;
      const Vec3 point = evaluator.geo(at) + 0.999 * mm * random_direction_off(random);
      EXPECT_FALSE(distance.exceeds(at.cell, point, mm)) << name << ", seed " << kDistanceSeed << ", cell " << at.cell
                                                         << " at " << at.uvw.transpose() << ", " << mm << " mm";
    }
  }
}

/// The least distance to 33 x 33 x 33 places of a cell.
double sampled_distance(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& point) {
  constexpr int kPlaces = 33;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kPlaces * kPlaces * kPlaces; ++i) {
    const Vec3 uvw(i % kPlaces, i / kPlaces % kPlaces, i / kPlaces / kPlaces);
    least = std::min(least, (evaluator.geo({cell, uvw / (kPlaces - 1)}) - point).norm());
  }
  return least;
}

// What is in a cell's box, and a tenth of the cell off it, is told.
TEST(CellDistance, IsProvedOfPointsThatAreOffTheCell) {
  std::mt19937 random(kDistanceSeed);
  for (const ControlMesh& mesh : {make_engine(), make_coyote()}) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    CellDistance distance(*solid);
    std::uniform_real_distribution<double> u(0, 1);
    int off = 0, proved = 0;
    for (int i = 0; i < 200; ++i) {
      const LimitCellId cell{static_cast<std::uint32_t>(random() % solid->cell_count())};
      const Box3 box = solid->index().cell_boxes.box(cell);
      const Vec3 point = box.min() + Vec3(u(random), u(random), u(random)).cwiseProduct(box.sizes());
      if (sampled_distance(evaluator, cell, point) < 0.1 * box.diagonal().norm()) continue;
      ++off;
      proved += distance.exceeds(cell, point, 1e-3) ? 1 : 0;
    }
    EXPECT_GT(off, 10);
    EXPECT_EQ(proved, off);
  }
}

TEST(CellDistance, OfPointsAsFarAsNumbersGoIsNoTrouble) {
  const auto solid = prepare_solid(make_box());
  CellDistance distance(*solid);
  for (const double far : {1e30, 1e300, 1e308, -1e308}) {
    EXPECT_NO_FATAL_FAILURE((void)distance.exceeds(LimitCellId{0}, Vec3(far, -far, 5e-324), 1e-3));
  }
  EXPECT_TRUE(distance.exceeds(LimitCellId{0}, Vec3(1e9, 0, 0), 1e-3));
}

}  // namespace
}  // namespace ccslice
