// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/orient_regions.h"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

/// Two unit squares side by side, the left one of region 3 and the right one of region 0. Edges between crossings,
/// which are the corners.
struct Squares {
  static constexpr std::size_t kInterface = 6;
  std::vector<RegionSegment> segments;
  std::vector<RegionEdge> edges;

  Squares() {
    add(0, 1, 3, kNoCellRegion);
    add(1, 2, 0, kNoCellRegion);
    add(2, 3, 0, kNoCellRegion);
    add(3, 4, 0, kNoCellRegion);
    add(4, 5, 3, kNoCellRegion);
    add(5, 0, 3, kNoCellRegion);
    add(1, 4, 3, 0);
  }

  void add(std::uint32_t from, std::uint32_t to, std::uint8_t left, std::uint8_t right) {
    const std::array<Vec2, 6> corners = {Vec2(0, 0), Vec2(1, 0), Vec2(2, 0), Vec2(2, 1), Vec2(1, 1), Vec2(0, 1)};
    segments.push_back({from, to, edges.size(), edges.size() + 1});
    edges.push_back({corners[from], corners[to], left, right});
  }

  void turn(std::size_t edge) {
    std::swap(segments[edge].from, segments[edge].to);
    std::swap(edges[edge].from, edges[edge].to);
  }

  void orient() { orient_regions(segments, 6, edges); }
};

void expect_same(const RegionEdge& edge, const RegionEdge& other) {
  EXPECT_EQ(edge.from, other.from);
  EXPECT_EQ(edge.to, other.to);
  EXPECT_EQ(edge.left, other.left);
  EXPECT_EQ(edge.right, other.right);
}

TEST(OrientRegions, KeepsEdgesThatAgree) {
  Squares squares;
  squares.orient();
  ASSERT_EQ(squares.edges.size(), 7u);
  for (std::size_t i = 0; i < 7; ++i) expect_same(squares.edges[i], Squares().edges[i]);
}

TEST(OrientRegions, TurnsWhatRunsAgainstMostOfItsLine) {
  Squares squares;
  squares.turn(4);
  squares.turn(Squares::kInterface);
  squares.orient();
  ASSERT_EQ(squares.edges.size(), 7u);
  // With two of its four edges turned, region 3 keeps the direction of its first edge.
  for (std::size_t i = 0; i < 7; ++i) expect_same(squares.edges[i], Squares().edges[i]);
}

// The frames of an inverted cell, region 0, are all turned, but not that of the interface, which is of its neighbour.
TEST(OrientRegions, PartsAnInterfaceThatTurnsForOneOfItsRegions) {
  Squares squares;
  for (const std::size_t edge : {1, 2, 3}) squares.turn(edge);
  const std::vector<RegionEdge> given = squares.edges;
  squares.orient();
  ASSERT_EQ(squares.edges.size(), 8u);
  for (std::size_t i = 0; i < 6; ++i) expect_same(squares.edges[i], given[i]);
  expect_same(squares.edges[6], {{1, 0}, {1, 1}, 3, kNoCellRegion});
  expect_same(squares.edges[7], {{1, 1}, {1, 0}, kNoCellRegion, 0});
}

// Squares of one region that touch in a corner, and one edge of each runs the wrong way.
TEST(OrientRegions, KeepsLinesApartThatTouch) {
  std::vector<RegionSegment> segments;
  std::vector<RegionEdge> edges;
  const std::array<Vec2, 7> corners = {Vec2(0, 0),  Vec2(1, 0),   Vec2(1, 1), Vec2(0, 1),
                                       Vec2(-1, 0), Vec2(-1, -1), Vec2(0, -1)};
  for (const auto& [from, to] :
       std::array<std::array<std::uint32_t, 2>, 8>{{{0, 1}, {1, 2}, {3, 2}, {3, 0}, {0, 4}, {4, 5}, {6, 5}, {6, 0}}}) {
    segments.push_back({from, to, edges.size(), edges.size() + 1});
    edges.push_back({corners[from], corners[to], 5, kNoCellRegion});
  }
  const std::vector<RegionEdge> given = edges;
  orient_regions(segments, corners.size(), edges);
  ASSERT_EQ(edges.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    RegionEdge expected = given[i];
    if (i == 2 || i == 6) std::swap(expected.from, expected.to);
    expect_same(edges[i], expected);
  }
}

TEST(OrientRegions, LeavesARegionAloneOneOfWhoseLinesEnds) {
  Squares squares;
  squares.turn(4);
  squares.add(0, 4, 3, kNoCellRegion);
  const std::vector<RegionEdge> given = squares.edges;
  squares.orient();
  ASSERT_EQ(squares.edges.size(), given.size());
  for (std::size_t i = 0; i < given.size(); ++i) expect_same(squares.edges[i], given[i]);
}

}  // namespace
}  // namespace ccslice
