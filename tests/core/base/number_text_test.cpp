// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

namespace ccslice {
namespace {

TEST(NumberText, IsShortForShortNumbers) {
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(-2.0), "-2");
  EXPECT_EQ(number_text(1e6), "1000000");
  EXPECT_EQ(number_text(2.0 / 3, 3), "0.667");
  EXPECT_EQ(number_text(12.5, 6), "12.5");
}

TEST(NumberText, TellsEachDoubleFromAllOthers) {
  EXPECT_NE(number_text(std::nextafter(1.0, 2)), "1");
  EXPECT_NE(number_text(std::nextafter(1e6, 0)), "1000000");
  constexpr std::uint32_t kSeed = 20261123;
  std::mt19937_64 random(kSeed);
  for (int k = 0; k < 2000; ++k) {
    double value;
    const std::uint64_t bits = random();
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) continue;
    ASSERT_EQ(std::strtod(number_text(value).c_str(), nullptr), value) << "seed " << kSeed;
  }
}

}  // namespace
}  // namespace ccslice
