// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/box_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

namespace ccslice {
namespace {

TEST(BoxTree, FindsNothingWhenEmpty) {
  BoxTree().visit_at(Vec3::Zero(), 1, [](std::uint32_t) { FAIL(); });
  BoxTree(std::span<const Box3>()).visit_at(Vec3::Zero(), 1, [](std::uint32_t) { FAIL(); });
}

std::vector<Box3> random_boxes(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> place(0, 10), size(0, 2);
  std::vector<Box3> boxes;
  while (boxes.size() < count) {
    const Vec3 low(place(random), place(random), place(random));
    boxes.emplace_back(low, low + Vec3(size(random), size(random), size(random)));
  }
  return boxes;
}

// Full nodes, nodes with one branch left, one level and several.
constexpr std::array<std::size_t, 11> kSizes = {1, 2, 3, 4, 5, 15, 16, 17, 64, 65, 500};

TEST(BoxTree, FindsWhatALinearScanFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 10), size(0, 1);
  for (const std::size_t count : kSizes) {
    const std::vector<Box3> boxes = random_boxes(count, random);
    const BoxTree tree(boxes);
    for (int i = 0; i < 500; ++i) {
      const Vec3 point(place(random), place(random), place(random));
      const double margin = i % 3 * 0.1;
      const Box3 other(point, point + Vec3(size(random), size(random), size(random)));
      std::multiset<std::uint32_t> expected, found, expected_meeting, meeting;
      for (std::uint32_t b = 0; b < boxes.size(); ++b) {
        const Box3 grown(boxes[b].min().array() - margin, boxes[b].max().array() + margin);
        if (grown.contains(point)) expected.insert(b);
        if (boxes[b].intersects(other)) expected_meeting.insert(b);
      }
      tree.visit_at(point, margin, [&](std::uint32_t item) { found.insert(item); });
      EXPECT_EQ(found, expected);
      EXPECT_EQ(tree.any_at(point, margin), !expected.empty());
      EXPECT_FALSE(tree.any_meeting(other, [&](std::uint32_t item) { return meeting.insert(item), false; }));
      EXPECT_EQ(meeting, expected_meeting);
    }
  }
}

// Nodes have room for what there is: one for each three boxes, and one with fewer for each level.
template <typename Tree>
void expect_no_more_than_nodes(std::size_t bytes_of_node) {
  std::mt19937 random(8);
  for (std::size_t count = 1; count < 600; count += 7) {
    const Tree tree(random_boxes(count, random));
    EXPECT_LE(tree.memory_bytes(), bytes_of_node * (count / 3 + 5) + 4 * count) << count << " boxes";
  }
}

TEST(BoxTree, TakesNoMoreThanItsNodes) { expect_no_more_than_nodes<BoxTree>(256); }
TEST(FloatBoxTree, TakesHalfTheMemory) { expect_no_more_than_nodes<FloatBoxTree>(128); }

TEST(BoxTree, KnowsTheBoxOfEachItem) {
  std::mt19937 random(8);
  for (const std::size_t count : kSizes) {
    const std::vector<Box3> boxes = random_boxes(count, random);
    const BoxTree tree(boxes);
    ASSERT_EQ(tree.size(), count);
    for (std::uint32_t b = 0; b < count; ++b) {
      EXPECT_EQ(tree.box(b).min(), boxes[b].min());
      EXPECT_EQ(tree.box(b).max(), boxes[b].max());
    }
  }
}

// Far from the origin, too, where a float has no digits left for them.
TEST(FloatBoxTree, HoldsItsBoxesAndIsHardlyLarger) {
  std::mt19937 random(10);
  for (const double far : {0.0, 3e5, -4e9}) {
    for (const std::size_t count : kSizes) {
      std::vector<Box3> boxes = random_boxes(count, random);
      for (Box3& box : boxes) box.translate(Vec3(far, 0.1 * far, -far));
      const FloatBoxTree tree(boxes);
      ASSERT_EQ(tree.size(), count);
      for (std::uint32_t b = 0; b < count; ++b) {
        EXPECT_TRUE(tree.box(b).contains(boxes[b])) << far;
        EXPECT_LT((tree.box(b).sizes() - boxes[b].sizes()).maxCoeff(), 12 * std::exp2(-22) + 1e-14 * std::abs(far));
      }
    }
  }
}

TEST(FloatBoxTree, MissesNothingThatALinearScanFinds) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::mt19937 random(7);
  std::uniform_int_distribution<std::uint32_t> side(0, 1);
  for (const double far : {0.0, 1e6}) {
    for (const std::size_t count : kSizes) {
      std::vector<Box3> boxes = random_boxes(count, random);
      for (Box3& box : boxes) box.translate(Vec3::Constant(far));
      const FloatBoxTree tree(boxes);
      for (int i = 0; i < 500; ++i) {  // On faces of boxes, where a question decides by the last bit.
        const std::uint32_t of = random() % count;
        Vec3 point = boxes[of].center();
        point[i % 3] = side(random) == 0 ? boxes[of].min()[i % 3] : boxes[of].max()[i % 3];
        // Every other point lies beside the box, so near to it that floats hardly have the margin.
        const double margin = i % 2 == 0 ? 0 : 1e-6 + 1e-12 * far;
        point[i % 3] += (point[i % 3] > boxes[of].center()[i % 3] ? margin : -margin) * (1 - 1e-3);
        std::set<std::uint32_t> expected, found;
        for (std::uint32_t b = 0; b < count; ++b) {
          if (boxes[b].exteriorDistance(point) <= margin) expected.insert(b);
        }
        tree.visit_at(point, margin, [&](std::uint32_t item) { found.insert(item); });
        EXPECT_TRUE(std::ranges::includes(found, expected)) << far;
        EXPECT_TRUE(tree.any_at(point, margin));
      }
      std::size_t found = 0;
      tree.any_meeting(Box3(Vec3::Constant(-kInfinity), Vec3::Constant(kInfinity)),
                       [&](std::uint32_t) { return ++found > count; });
      EXPECT_EQ(found, count);
    }
  }
}

TEST(BoxTree, FindsWhetherAnyAcceptedBoxMeetsAnother) {
  const std::vector<Box3> boxes = {Box3(Vec3::Zero(), Vec3::Ones()), Box3(Vec3::Ones(), Vec3::Constant(2)),
                                   Box3(Vec3::Constant(5), Vec3::Constant(6))};
  const BoxTree tree(boxes);
  const Box3 corner(Vec3::Ones(), Vec3::Constant(1.5));
  EXPECT_TRUE(tree.any_meeting(corner, [](std::uint32_t item) { return item == 0; }));
  EXPECT_TRUE(tree.any_meeting(corner, [](std::uint32_t item) { return item == 1; }));
  EXPECT_FALSE(tree.any_meeting(corner, [](std::uint32_t item) { return item == 2; }));
  EXPECT_FALSE(tree.any_meeting(Box3(Vec3::Constant(3), Vec3::Constant(4)), [](std::uint32_t) { return true; }));
}

TEST(BoxTree, FindsAllInABoxWithoutEnd) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::mt19937 random(9);
  for (const std::size_t count : kSizes) {
    const BoxTree tree(random_boxes(count, random));
    std::size_t found = 0;
    tree.any_meeting(Box3(Vec3::Constant(-kInfinity), Vec3::Constant(kInfinity)),
                     [&](std::uint32_t) { return ++found > count; });
    EXPECT_EQ(found, count);
  }
}

TEST(BoxTree, StopsWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const std::vector<Box3> boxes(10, Box3(Vec3::Zero(), Vec3::Ones()));
  EXPECT_THROW(BoxTree(boxes, cancel), Error);
}

TEST(BoxTree, StandsManyEqualBoxes) {
  const std::vector<Box3> boxes(10'000, Box3(Vec3::Zero(), Vec3::Ones()));
  int count = 0;
  BoxTree(boxes).visit_at(Vec3::Constant(0.5), 0, [&](std::uint32_t) { ++count; });
  EXPECT_EQ(count, 10'000);
}

}  // namespace
}  // namespace ccslice
