// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/start_places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

// More cells than are kept, in any order.
TEST(StartPlaces, AreWhereTheirCellsHaveThem) {
  constexpr unsigned kSeed = 5;
  const auto solid = prepare_solid(oracle::tiny_mesh("cross_of_seven"));
  LimitEvaluator evaluator(*solid);
  StartPlaces<4> starts(4);
  std::mt19937 random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const LimitCellId cell{static_cast<std::uint32_t>(random() % std::min(7u, solid->cell_count()))};
    const auto& places = starts.of(cell, evaluator);
    for (std::size_t k = 0; k < places.size(); ++k) {
      EXPECT_EQ(places[k], evaluator.geo({cell, StartPlaces<4>::parameter(k)})) << "seed " << kSeed;
    }
  }
}

TEST(StartPlaces, AreMiddlesOfParts) {
  EXPECT_EQ(StartPlaces<2>::parameter(0), Vec3(0.25, 0.25, 0.25));
  EXPECT_EQ(StartPlaces<2>::parameter(6), Vec3(0.25, 0.75, 0.75));
  EXPECT_EQ(StartPlaces<4>::parameter(63), Vec3(0.875, 0.875, 0.875));
}

}  // namespace
}  // namespace ccslice
