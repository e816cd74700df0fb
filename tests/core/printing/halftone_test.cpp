// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/halftone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/core/printing/halftoned_blocks.h"

namespace ccslice {
namespace {

class Method : public testing::TestWithParam<HalftoneMethod> {};

TEST_P(Method, NeverTakesAMaterialThatIsAbsent) {
  for (const std::vector<float>& fractions :
       {std::vector<float>{1, 0}, {0, 1}, {0, 1, 0}, {0.4f, 0, 0.6f}, {0, 0.01f, 0.99f}}) {
    const HalftonedBlock block = constant_block(shares_of(fractions.size(), GetParam(), 3), fractions, {200, 40, 10});
    for (const std::uint8_t material : block.materials) {
      ASSERT_GE(material, 1);
      ASSERT_LE(material, fractions.size());
      ASSERT_GT(fractions[material - 1u], 0);
    }
  }
}

TEST_P(Method, FollowsFromVoxelAndSeedAlone) {
  const auto wave = [](std::size_t x, std::size_t y, std::size_t z) {
    return std::vector<float>{1.0f + std::sin(0.05f * static_cast<float>(x + 2 * y + 3 * z))};
  };
  const HalftonePlan plan = plan_of(blend_of(3, GetParam(), 5));
  const HalftonedBlock whole = halftone_block(plan, kPitch, {150, 30, 9}, wave);
  const HalftonedBlock part = halftone_block(plan, kPitch, {150, 30, 4}, wave, 5);
  EXPECT_TRUE(std::equal(part.materials.begin(), part.materials.end(), whole.materials.begin() + 150 * 30 * 5));
  const HalftonedBlock again = halftone_block(plan_of(blend_of(3, GetParam(), 5)), kPitch, {150, 30, 9}, wave);
  EXPECT_EQ(again.materials, whole.materials);
  if (GetParam() == HalftoneMethod::kLargestFraction) return;
  const HalftonedBlock other = halftone_block(plan_of(blend_of(3, GetParam(), 6)), kPitch, {150, 30, 9}, wave);
  EXPECT_NE(other.materials, whole.materials);
}

INSTANTIATE_TEST_SUITE_P(All, Method,
                         testing::Values(HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion,
                                         HalftoneMethod::kLargestFraction, HalftoneMethod::kWhiteNoise));

TEST(Nearest, TakesTheLargestFractionAndTheFirstOfEquals) {
  const auto of = [](const std::vector<float>& fractions) {
    return constant_block(shares_of(fractions.size(), HalftoneMethod::kLargestFraction), fractions, {1, 1, 1})
        .materials[0];
  };
  EXPECT_EQ(of({0.2f, 0.5f, 0.3f}), 2);
  EXPECT_EQ(of({0.5f, 0.5f}), 1);
  EXPECT_EQ(of({0.1f, 0.45f, 0.45f}), 2);
}

}  // namespace
}  // namespace ccslice
