// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/nearest_solved.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace ccslice {
namespace {

// A picture of a small layer: '#' solved, '?' inside but unresolved, '.' outside.
struct Picture {
  std::uint32_t width, height;
  std::vector<char> voxels;

  char at(std::uint32_t x, std::uint32_t y) const { return voxels[std::size_t{width} * y + x]; }

  std::vector<VoxelRun> runs(const std::string& kinds) const {
    std::vector<VoxelRun> result;
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        if (kinds.find(at(x, y)) == std::string::npos) continue;
        if (!result.empty() && result.back().row == y && result.back().end == x) {
          ++result.back().end;
        } else {
          result.push_back({y, x, x + 1});
        }
      }
    }
    return result;
  }
};

Picture random_picture(std::mt19937& random) {
  const auto roll = [&](std::uint32_t sides) { return static_cast<std::uint32_t>(random() % sides); };
  Picture picture{1 + roll(20), 1 + roll(20), {}};
  const std::uint32_t solved = 1 + roll(8);
  for (std::uint32_t i = 0; i < picture.width * picture.height; ++i) {
    const std::uint32_t dice = roll(10);
    picture.voxels.push_back(dice < solved ? '#' : dice < 9 ? '?' : '.');
  }
  picture.voxels[roll(picture.width * picture.height)] = '#';
  return picture;
}

// Every voxel in the order that breaks ties.
NearestSolved::Voxel nearest_by_search(const Picture& picture, const LayerLattice& lattice, std::uint32_t x,
                                       std::uint32_t y) {
  NearestSolved::Voxel best{};
  double best_distance2 = 1e300;
  for (std::uint32_t j = 0; j < picture.height; ++j) {
    for (std::uint32_t i = 0; i < picture.width; ++i) {
      if (picture.at(i, j) != '#') continue;
      const double dx = lattice.dx_mm * (double(i) - x);
      const double dy = lattice.dy_mm * (double(j) - y);
      if (dx * dx + dy * dy < best_distance2) {
        best_distance2 = dx * dx + dy * dy;
        best = {i, j};
      }
    }
  }
  return best;
}

TEST(NearestSolved, AgreesWithASearchOfAllVoxels) {
  std::mt19937 random(20190525);
  for (int i = 0; i < 300; ++i) {
    const Picture picture = random_picture(random);
    LayerLattice lattice;
    lattice.dx_mm = 0.25;  // Exact in binary: ties are ties.
    lattice.dy_mm = random() % 2 ? 0.25 : 0.75;
    lattice.width = picture.width;
    lattice.height = picture.height;
    NearestSolved nearest(picture.runs("#?"), picture.runs("?"), lattice);
    ASSERT_FALSE(nearest.empty());
    for (std::uint32_t y = 0; y < picture.height; ++y) {
      for (std::uint32_t x = 0; x < picture.width; ++x) {
        const NearestSolved::Voxel found = nearest.nearest(x, y);
        const NearestSolved::Voxel expected = nearest_by_search(picture, lattice, x, y);
        ASSERT_EQ(found.x, expected.x);
        ASSERT_EQ(found.y, expected.y);
      }
    }
  }
}

TEST(NearestSolved, TakesTheNearestRowOnceItsWorkIsSpent) {
  // Column 9 of row 0, and column 0 of row 2: the second is nearer to (0, 0), but row 0 is the nearest row.
  const std::vector<VoxelRun> inside = {{0, 0, 10}, {1, 0, 10}, {2, 0, 10}};
  const std::vector<VoxelRun> holes = {{0, 0, 9}, {1, 0, 10}, {2, 1, 10}};
  LayerLattice lattice;
  lattice.dx_mm = lattice.dy_mm = 1;
  lattice.width = 10;
  lattice.height = 3;
  NearestSolved nearest(inside, holes, lattice, 3);
  EXPECT_EQ(nearest.nearest(0, 0).y, 2u);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(nearest.nearest(0, 0).y, 0u);
    EXPECT_EQ(nearest.nearest(0, 0).x, 9u);
  }
}

TEST(NearestSolved, IsEmptyWhenNothingIsSolved) {
  LayerLattice lattice;
  lattice.width = 8;
  lattice.height = 2;
  const std::vector<VoxelRun> inside = {{0, 1, 3}, {1, 2, 5}};
  EXPECT_TRUE(NearestSolved(inside, inside, lattice).empty());
  EXPECT_TRUE(NearestSolved({}, {}, lattice).empty());
  EXPECT_FALSE(NearestSolved(inside, {}, lattice).empty());
}

}  // namespace
}  // namespace ccslice
