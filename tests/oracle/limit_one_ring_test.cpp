// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit evaluation against brute force on cut-out one-rings, down to parameters of 2^-16.

#include <gtest/gtest.h>

#include "tests/oracle/descents.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kOneRingTolerance = 1e-9;
constexpr int kLevels = 16;
constexpr std::uint32_t kMostCells = 12;

class OneRings : public testing::TestWithParam<std::size_t> {};

TEST_P(OneRings, LimitAgreesWithBruteForceDownToTinyParameters) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  WorstError worst;
  const std::uint32_t stride = subject.solid().cell_count() / kMostCells + 1;
  for (LimitCellId cell; cell < subject.solid().cell_count(); cell += stride) {
    for (int corner = 0; corner < 8; ++corner) {
      Descent to_corner;
      to_corner.levels = kLevels;
      to_corner.fixed_bits = corner;
      to_corner.irregular_end = corner == static_cast<int>(cell % 8);
      compare_on_descent(subject, evaluator, cell, to_corner, random, worst);
    }
    for (int i = 0; i < 8; ++i) {
      compare_on_descent(subject, evaluator, cell, random_descent(random, kLevels, i == 0), random, worst);
    }
  }
  EXPECT_GT(worst.samples, 1000u);
  EXPECT_LT(worst.position, kOneRingTolerance) << worst.position_at;
  EXPECT_LT(worst.channel, kOneRingTolerance) << worst.channel_at;
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, OneRings, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

}  // namespace
}  // namespace ccslice::oracle
