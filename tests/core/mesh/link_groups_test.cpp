// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/link_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace ccslice {
namespace {

using testing::Each;
using testing::ElementsAre;

/// Triangles by their three vertices; those that share two vertices share an edge.
std::vector<LinkTriangle> link_of(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<LinkTriangle> link;
  for (const auto& triangle : triangles) {
    LinkTriangle& added = link.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      added.edges[i].opposite = triangle[i];
      for (std::uint32_t other = 0; other < triangles.size(); ++other) {
        const auto has = [&](std::uint32_t v) {
          return std::ranges::find(triangles[other], v) != triangles[other].end();
        };
        if (triangles[other] != triangle && has(triangle[(i + 1) % 3]) && has(triangle[(i + 2) % 3])) {
          added.edges[i].beyond = other;
        }
      }
    }
  }
  return link;
}

/// The link of a vertex among eight voxels, with poles 0 and 1 and four vertices round.
const std::vector<std::array<std::uint32_t, 3>> kOctahedron = {{0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 2},
                                                               {1, 2, 3}, {1, 3, 4}, {1, 4, 5}, {1, 5, 2}};

std::vector<std::array<std::uint32_t, 3>> some_of(const std::vector<std::size_t>& chosen) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const std::size_t i : chosen) triangles.push_back(kOctahedron[i]);
  return triangles;
}

TEST(LinkGroups, LeaveSpheresAndDiscsWhole) {
  for (const auto& chosen : std::vector<std::vector<std::size_t>>{
           {0}, {0, 1}, {0, 1, 2}, {0, 1, 2, 3}, {0, 1, 2, 4}, {0, 1, 2, 3, 4, 5, 6}, {0, 1, 2, 3, 4, 5, 6, 7}}) {
    const std::vector<LinkTriangle> link = link_of(some_of(chosen));
    const LinkGroups groups = group_link(link);
    EXPECT_EQ(groups.count, 1u) << chosen.size();
    EXPECT_EQ(groups.cuts, 0u);
    EXPECT_THAT(groups.groups, Each(0u));
    EXPECT_EQ(fans_of_link(link).count, 1u);
  }
}

TEST(LinkGroups, AreFansWhereNoEdgesJoinThem) {
  const std::vector<LinkTriangle> link = link_of(some_of({0, 2, 6}));
  EXPECT_THAT(fans_of_link(link).groups, ElementsAre(0, 1, 1));
  EXPECT_THAT(group_link(link).groups, ElementsAre(0, 1, 1));
  EXPECT_EQ(group_link(link).cuts, 0u);
}

TEST(LinkGroups, CutABandIntoTwoDiscs) {
  const std::vector<LinkTriangle> band = link_of(some_of({1, 2, 3, 4, 5, 7}));  // Without two opposite ones.
  EXPECT_EQ(fans_of_link(band).count, 1u);
  const LinkGroups groups = group_link(band);
  EXPECT_EQ(groups.count, 2u);
  EXPECT_EQ(groups.cuts, 2u);
}

TEST(LinkGroups, CutOffATriangleThatTouchesTheOthersInAVertex) {
  // Four round the upper pole, and two below that meet in the lower one.
  const std::vector<LinkTriangle> link = link_of(some_of({0, 1, 2, 3, 4, 6}));
  EXPECT_EQ(fans_of_link(link).count, 1u);
  const LinkGroups groups = group_link(link);
  EXPECT_EQ(groups.count, 2u);
  EXPECT_EQ(groups.cuts, 1u);
  EXPECT_NE(groups.groups[4], groups.groups[5]);
}

TEST(LinkGroups, AreDiscsWhateverTheLink) {
  for (std::size_t mask = 1; mask < 256; ++mask) {
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < 8; ++i) {
      if (mask >> i & 1) chosen.push_back(i);
    }
    const auto triangles = some_of(chosen);
    const LinkGroups groups = group_link(link_of(triangles));
    for (std::uint32_t group = 0; group < groups.count; ++group) {
      // The Euler characteristic of a disc is 1, that of a sphere 2; any two triangles of a group are joined.
      std::vector<std::uint32_t> vertices;
      std::vector<std::array<std::uint32_t, 2>> edges;
      std::ptrdiff_t faces = 0;
      for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (groups.groups[i] != group) continue;
        ++faces;
        for (std::size_t k = 0; k < 3; ++k) {
          vertices.push_back(triangles[i][k]);
          edges.push_back({std::min(triangles[i][k], triangles[i][(k + 1) % 3]),
                           std::max(triangles[i][k], triangles[i][(k + 1) % 3])});
        }
      }
      const auto count = [](auto& items) {
        std::ranges::sort(items);
        return std::unique(items.begin(), items.end()) - items.begin();
      };
      const auto euler = count(vertices) - count(edges) + faces;
      EXPECT_EQ(euler, faces == 8 ? 2 : 1) << mask;
    }
  }
}

}  // namespace
}  // namespace ccslice
