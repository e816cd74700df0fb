// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/surface_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/core/contour/surface_points.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kMeshSeed = 20261123;

TEST(SurfaceBox, CornersGoCounterClockwiseAndQuartersTileIt) {
  const SurfaceBox box{BoundaryFaceId{3}, kSurfaceOne / 4, kSurfaceOne / 2, kSurfaceOne / 4};
  const std::uint32_t s = box.s, t = box.t, size = box.size;
  EXPECT_EQ(box.corner(0), (std::array{s, t}));
  EXPECT_EQ(box.corner(1), (std::array{s + size, t}));
  EXPECT_EQ(box.corner(2), (std::array{s + size, t + size}));
  EXPECT_EQ(box.corner(3), (std::array{s, t + size}));
  for (int quarter = 0; quarter < 4; ++quarter) {
    const SurfaceBox part = box.quarter(quarter % 2, quarter / 2);
    EXPECT_EQ(std::tuple(part.face, part.s, part.t, part.size),
              std::tuple(3u, s + quarter % 2 * size / 2, t + quarter / 2 * size / 2, size / 2));
  }
}

// Vertices at 1/2, 1/4, 3/8 of the side, and one that is no end of a halving: 1/8 without 1/4 isn't looked for.
TEST(WalkSide, HalvesASideWhereverThereIsAVertex) {
  constexpr std::uint32_t kEighth = kSurfaceOne / 8;
  const auto walk = [&](const std::set<std::uint32_t>& vertices, bool backwards) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    const auto vertex_at = [&](std::uint32_t s, std::uint32_t t) {
      EXPECT_EQ(t, 5u);
      return s % kEighth == 0 && vertices.contains(s / kEighth) ? s / kEighth : IdTable<SurfaceKey>::kNone;
    };
    const RimVertex low{0, 0, 5}, high{8, kSurfaceOne, 5};
    const auto visit = [&](int side, const RimVertex& from, const RimVertex& to) {
      EXPECT_EQ(side, 2);
      EXPECT_EQ(from.id * kEighth, from.s);
      EXPECT_EQ(to.id * kEighth, to.s);
      edges.emplace_back(from.id, to.id);
    };
    walk_side(2, backwards ? high : low, backwards ? low : high, vertex_at, visit);
    return edges;
  };
  using Edges = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  EXPECT_EQ(walk({}, false), (Edges{{0, 8}}));
  EXPECT_EQ(walk({4, 2, 3}, false), (Edges{{0, 2}, {2, 3}, {3, 4}, {4, 8}}));
  EXPECT_EQ(walk({4, 2, 3}, true), (Edges{{8, 4}, {4, 3}, {3, 2}, {2, 0}}));
  EXPECT_EQ(walk({1}, false), (Edges{{0, 8}}));
}

/// Halves boxes at random and enters what halving has to.
void halve_at_random(const SurfaceBox& box, int depth, SurfaceVertices& vertices, std::mt19937& random,
                     std::vector<SurfaceBox>& leaves) {
  if (depth == 0 || random() % 3 == 0) {
    leaves.push_back(box);
    for (int k = 0; k < 4; ++k) vertices.insert(box.face, box.corner(k)[0], box.corner(k)[1]);
    return;
  }
  vertices.enter_middles(box);
  for (int quarter = 0; quarter < 4; ++quarter) {
    halve_at_random(box.quarter(quarter % 2, quarter / 2), depth - 1, vertices, random, leaves);
  }
}

// However finely each face is halved: the leaves make a closed surface.
TEST(SurfaceVertices, EveryFinestEdgeIsSharedByTwoLeavesInOppositeDirections) {
  std::mt19937 random(kMeshSeed);
  bool several_sizes = false;
  for (const char* name : kSurfaceMeshes) {
    SurfacePoints points(oracle::tiny_mesh(name), kMeshSeed);
    for (int trial = 0; trial < 4; ++trial) {
      SurfaceVertices vertices(points.surface);
      std::vector<SurfaceBox> leaves;
      std::vector<std::uint32_t> middles;
      for (const BoundaryFaceId face : points.surface.face_ids()) {
        vertices.enter_coarser_middles(face, middles);
        halve_at_random({face}, trial, vertices, random, leaves);
      }
      several_sizes |= !middles.empty();
      std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;  // Directed.
      std::map<std::uint32_t, Vec3> places;
      for (const SurfaceBox& leaf : leaves) {
        std::uint32_t first = 0, last = 0;
        bool started = false;
        vertices.walk_rim(leaf, [&](int, const RimVertex& from, const RimVertex& to) {
          if (started) {
            EXPECT_EQ(from.id, last);
          } else {
            first = from.id;
          }
          started = true;
          last = to.id;
          ++edges[{from.id, to.id}];
          const Vec3 place = points.at_vertex(leaf.face, from.s, from.t);
          EXPECT_LT((places.try_emplace(from.id, place).first->second - place).norm(), 1e-9) << name;
        });
        EXPECT_EQ(first, last);
      }
      for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1) << name << ", seed " << kMeshSeed;
        ASSERT_TRUE(edges.contains({edge.second, edge.first})) << name << ", seed " << kMeshSeed;
      }
      EXPECT_EQ(places.size(), vertices.size()) << name;
    }
  }
  EXPECT_TRUE(several_sizes);
}

TEST(SurfaceVertices, MiddlesAreOfTheSidesInOrder) {
  SurfacePoints points(oracle::tiny_mesh("box_3"), kMeshSeed);
  SurfaceVertices vertices(points.surface);
  const SurfaceBox box{BoundaryFaceId{2}, kSurfaceOne / 2, 0, kSurfaceOne / 2};
  const std::array<std::uint32_t, 4> middles = vertices.enter_middles(box);
  for (int k = 0; k < 4; ++k) {
    const auto [s0, t0] = box.corner(k);
    const auto [s1, t1] = box.corner((k + 1) % 4);
    EXPECT_EQ(vertices.find(BoundaryFaceId{2}, std::midpoint(s0, s1), std::midpoint(t0, t1)), middles[k]);
  }
  EXPECT_EQ(vertices.size(), 4u);
  EXPECT_EQ(vertices.enter_middles(box), middles);
  EXPECT_EQ(vertices.find(BoundaryFaceId{2}, 0, 0), IdTable<SurfaceKey>::kNone);
  vertices.clear();
  EXPECT_EQ(vertices.size(), 0u);
}

}  // namespace
}  // namespace ccslice
