// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/box_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Pairs pairs_of(const std::vector<Box3>& boxes) {
  const BoxBlocks blocks(boxes, {});
  Pairs pairs;
  for (std::uint32_t block = 0; block < blocks.size(); ++block) {
    EXPECT_TRUE(blocks.visit_pairs(
        block, [&](std::uint32_t i, std::uint32_t j) { return pairs.push_back(std::minmax(i, j)), true; }));
  }
  std::ranges::sort(pairs);
  return pairs;
}

TEST(BoxBlocks, VisitsEachPairThatMeetsOnce) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> at(0, 10), extent(0, 1);
  for (const std::size_t count : {0, 1, 2, 31, 32, 33, 64, 257, 700}) {
    std::vector<Box3> boxes;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 low(1e5 + at(random), at(random), at(random));
      boxes.emplace_back(low, low + Vec3(extent(random), extent(random), extent(random)));
    }
    const Pairs found = pairs_of(boxes);
    EXPECT_EQ(std::ranges::adjacent_find(found), found.end());
    Pairs missed;
    std::size_t meet = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      for (std::uint32_t j = i + 1; j < count; ++j) {
        if (!boxes[i].intersects(boxes[j])) continue;
        ++meet;
        if (!std::ranges::binary_search(found, std::pair(i, j))) missed.emplace_back(i, j);
      }
    }
    EXPECT_TRUE(missed.empty()) << missed.size() << " of " << meet;
    EXPECT_LE(found.size(), meet + 2) << "boxes are rounded by little";
  }
}

TEST(BoxBlocks, KnowsBoxesThatTouchInAPlane) {
  std::vector<Box3> boxes;
  for (int i = 0; i < 50; ++i) boxes.emplace_back(Vec3(i / 3.0, 0, 0), Vec3((i + 1) / 3.0, 1, 0));
  EXPECT_EQ(pairs_of(boxes).size(), 49u);
}

TEST(BoxBlocks, EndsWhereEverythingMeetsEverything) {
  constexpr std::size_t kBlocks = BoxBlocks::kMostPartners + 2;
  const std::vector<Box3> boxes(kBlocks * BoxBlocks::kBlockBoxes, Box3(Vec3::Zero(), Vec3::Ones()));
  const BoxBlocks blocks(boxes, {});
  std::size_t pairs = 0;
  EXPECT_FALSE(blocks.visit_pairs(0, [&](std::uint32_t, std::uint32_t) { return ++pairs, true; }));
  EXPECT_EQ(pairs, BoxBlocks::kMostPartners * 32 * 32 + 32 * 31 / 2);
  pairs = 0;
  EXPECT_FALSE(blocks.visit_pairs(0, [&](std::uint32_t, std::uint32_t) { return ++pairs < 5; }));
  EXPECT_EQ(pairs, 5u);
  EXPECT_TRUE(blocks.visit_pairs(blocks.size() - 1, [](std::uint32_t, std::uint32_t) { return true; }));
}

}  // namespace
}  // namespace ccslice
