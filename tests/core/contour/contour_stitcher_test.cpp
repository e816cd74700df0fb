// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_stitcher.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace ccslice {
namespace {

void add_crossings(ContourStitcher& stitcher, const std::vector<Vec2>& points) {
  for (const Vec2& xy : points) stitcher.add_crossing({.face = {}, .s = 0, .t = 0, .xy = xy});
}

std::vector<double> xs(const ContourLoop& loop) {
  std::vector<double> values;
  for (const ContourPoint& point : loop.points) values.push_back(point.xy.x());
  return values;
}

TEST(ContourStitcher, LoopsStartAtTheirLowestCrossing) {
  ContourStitcher stitcher;
  add_crossings(stitcher, {{0, 0}, {1, 5}, {2, 0}, {3, 5}, {4, 1}, {5, 1}});
  stitcher.add_segment(5, 3);
  stitcher.add_segment(0, 4);
  stitcher.add_segment(4, 2);
  stitcher.add_segment(3, 1);
  stitcher.add_segment(2, 0);
  stitcher.add_segment(1, 5);
  const std::vector<ContourLoop> loops = stitcher.loops(0);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(xs(loops[0]), (std::vector<double>{0, 4, 2}));
  EXPECT_EQ(xs(loops[1]), (std::vector<double>{1, 5, 3}));
}

TEST(ContourStitcher, MostSegmentsDecideOnTheDirection) {
  ContourStitcher stitcher;
  add_crossings(stitcher, {{0, 0}, {1, 0}, {2, 1}, {3, 2}});
  stitcher.add_segment(0, 1);
  stitcher.add_segment(2, 1);
  stitcher.add_segment(3, 2);
  stitcher.add_segment(0, 3);
  const std::vector<ContourLoop> tie = stitcher.loops(0);
  EXPECT_EQ(tie[0].points.size(), 4u);

  stitcher.clear();
  add_crossings(stitcher, {{0, 0}, {1, 0}, {2, 1}});
  stitcher.add_segment(0, 1);
  stitcher.add_segment(2, 1);
  stitcher.add_segment(0, 2);
  EXPECT_EQ(xs(stitcher.loops(0)[0]), (std::vector<double>{0, 2, 1}));
}

TEST(ContourStitcher, KnowsWhichSegmentsRunAgainstTheirLoop) {
  ContourStitcher stitcher;
  add_crossings(stitcher, {{0, 0}, {1, 0}, {2, 1}, {3, 0}, {4, 0}});
  stitcher.add_segment(0, 1);
  stitcher.add_segment(2, 1);
  stitcher.add_segment(3, 4);
  stitcher.add_segment(0, 2);
  stitcher.add_segment(4, 3);
  EXPECT_EQ(stitcher.segments_against(), (std::vector<bool>{true, false, false, false, false}));
}

TEST(ContourStitcher, LeavesOutRepeatedPointsAndWhatIsNoLoopWithoutThem) {
  ContourStitcher stitcher;
  add_crossings(stitcher, {{0, 0}, {1, 0}, {1, 1e-9}, {1, 1}, {1e-9, 0}, {7, 7}, {8, 8}});
  for (const auto& [from, to] : {std::pair{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 0}, {5, 6}, {6, 5}}) {
    stitcher.add_segment(from, to);
  }
  const std::vector<ContourLoop> loops = stitcher.loops(1e-8);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(xs(loops[0]), (std::vector<double>{0, 1, 1}));
}

TEST(ContourStitcher, KeepsWhatLiesBetweenInTheOrderOfTheLoop) {
  ContourStitcher stitcher;
  add_crossings(stitcher, {{0, 0}, {1, 0}, {2, 1}});
  const auto add_between = [&](const std::vector<double>& values) {
    for (const double x : values) stitcher.add_between({.face = {}, .s = 0, .t = 0, .xy = {x, 0}});
  };
  add_between({0.3, 0.6});
  stitcher.add_segment(0, 1);
  add_between({1.7, 1.3});
  stitcher.add_segment(2, 1);  // Against the loop.
  stitcher.add_segment(2, 0);
  EXPECT_EQ(xs(stitcher.loops(0)[0]), (std::vector<double>{0, 0.3, 0.6, 1, 1.3, 1.7, 2}));
}

TEST(ContourStitcher, RefusesForksAndOpenEnds) {
  ContourStitcher stitcher;
  add_crossings(stitcher, {{0, 0}, {1, 0}, {2, 0}, {3, 0}});
  stitcher.add_segment(0, 1);
  EXPECT_THROW(stitcher.loops(0), Error);
  stitcher.add_segment(1, 2);
  EXPECT_THROW(stitcher.add_segment(1, 3), Error);
}

}  // namespace
}  // namespace ccslice
