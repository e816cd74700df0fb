// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/region_colours.h"

#include <gtest/gtest.h>

#include <set>

namespace ccslice {
namespace {

TEST(RegionColours, AreDifferentAndOpaqueForAsManyAsThereMayBe) {
  const std::vector<std::uint32_t> palette = region_palette(255);
  ASSERT_EQ(palette.size(), 256u);
  EXPECT_EQ(std::set<std::uint32_t>(palette.begin(), palette.end()).size(), 256u);
  EXPECT_EQ(palette[0], 0u);
  for (std::size_t i = 1; i < palette.size(); ++i) EXPECT_EQ(palette[i] & 0xff, 0xffu);
}

TEST(RegionColours, DontDependOnTheNumberOfRegions) {
  const std::vector<std::uint32_t> few = region_palette(3), many = region_palette(40);
  for (std::size_t i = 0; i < few.size(); ++i) EXPECT_EQ(few[i], many[i]);
}

}  // namespace
}  // namespace ccslice
