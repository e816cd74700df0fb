// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/occupancy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "tests/support/allocation_count.h"
#include "tests/support/winding_number.h"

namespace ccslice {
namespace {

using oracle::Polygon;

Contours contours_of(const std::vector<Polygon>& polygons) {
  Contours contours;
  for (const Polygon& polygon : polygons) {
    ContourLoop& loop = contours.loops.emplace_back();
    for (const Vec2& point : polygon) loop.points.push_back({.face = BoundaryFaceId{0}, .s = 0, .t = 0, .xy = point});
  }
  return contours;
}

Polygon rectangle(double x0, double y0, double x1, double y1) { return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}; }

BitImage occupancy(const std::vector<Polygon>& polygons, const LayerLattice& lattice) {
  return to_bit_image(rasterize(contours_of(polygons), lattice), lattice.width, lattice.height);
}

std::size_t count(const BitImage& image) {
  std::size_t set = 0;
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) set += image.get(x, y);
  }
  return set;
}

/// The number of voxels at which scan conversion and the winding number per voxel differ, those nearer than
/// `ignored_mm` to a contour left out.
std::size_t differences(const std::vector<Polygon>& polygons, const LayerLattice& lattice, double ignored_mm) {
  const BitImage image = occupancy(polygons, lattice);
  std::size_t different = 0;
  for (std::uint32_t j = 0; j < lattice.height; ++j) {
    for (std::uint32_t i = 0; i < lattice.width; ++i) {
      const Vec2 centre(lattice.x0_mm + (i + 0.5) * lattice.dx_mm, lattice.y0_mm + (j + 0.5) * lattice.dy_mm);
      const bool inside = oracle::winding_number(polygons, centre) != 0;
      if (inside != image.get(i, j) && oracle::distance_to(polygons, centre) >= ignored_mm) ++different;
    }
  }
  return different;
}

TEST(Occupancy, ACentreOnAnEdgeBelongsToTheSideOfLargerXAndY) {
  const LayerLattice lattice{.x0_mm = -0.5, .y0_mm = -0.5, .dx_mm = 1, .dy_mm = 1, .width = 8, .height = 8};
  const BitImage image = occupancy({rectangle(2, 3, 5, 6)}, lattice);
  EXPECT_EQ(count(image), 9u);
  EXPECT_TRUE(image.get(2, 3));
  EXPECT_TRUE(image.get(4, 5));
  EXPECT_FALSE(image.get(5, 3));
  EXPECT_FALSE(image.get(2, 6));
}

TEST(Occupancy, AbuttingSolidsShareNoVoxelAndLeaveNone) {
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 0.1, .dy_mm = 0.07, .width = 64, .height = 90};
  const Vec2 a(0.31, 0.11), b(5.9, 0.2), c(6.1, 5.7), d(0.2, 6.05);
  const BitImage left = occupancy({{a, b, d}}, lattice), right = occupancy({{b, c, d}}, lattice);
  const BitImage both = occupancy({{a, b, c, d}}, lattice);
  EXPECT_EQ(count(left) + count(right), count(both));
  for (std::size_t k = 0; k < both.bits.size(); ++k) {
    EXPECT_EQ(left.bits[k] & right.bits[k], 0);
    EXPECT_EQ(left.bits[k] | right.bits[k], both.bits[k]);
  }
}

TEST(Occupancy, HolesAreOutsideAndOverlapsInside) {
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 20, .height = 20};
  Polygon hole = rectangle(4, 4, 8, 8);
  std::reverse(hole.begin(), hole.end());
  const BitImage image = occupancy({rectangle(2, 2, 12, 12), hole, rectangle(10, 10, 18, 18)}, lattice);
  EXPECT_EQ(count(image), 100u - 16u + 64u - 4u);
  EXPECT_FALSE(image.get(5, 5));
  EXPECT_TRUE(image.get(11, 11));
}

TEST(Occupancy, ClockwiseLoopsFillToo) {
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 9, .height = 9};
  Polygon clockwise = rectangle(1, 2, 6, 5);
  std::reverse(clockwise.begin(), clockwise.end());
  EXPECT_EQ(count(occupancy({clockwise}, lattice)), 15u);
}

TEST(Occupancy, LoopsReachBeyondTheLattice) {
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 13, .height = 11};
  EXPECT_EQ(count(occupancy({rectangle(-50, -50, 50, 50)}, lattice)), 13u * 11u);
  EXPECT_EQ(count(occupancy({rectangle(-50, 3, 4, 5)}, lattice)), 8u);
  EXPECT_EQ(count(occupancy({rectangle(9, -7, 70, 70)}, lattice)), 4u * 11u);
  EXPECT_EQ(count(occupancy({rectangle(20, 20, 30, 30), rectangle(-9, -9, -2, -2)}, lattice)), 0u);
}

TEST(Occupancy, NoContoursNoVoxels) {
  EXPECT_TRUE(rasterize({}, {.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 5, .height = 5}).empty());
}

TEST(Occupancy, SpansAreMaximalAndInOrder) {
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 30, .height = 4};
  // The second rectangle starts where the first ends; the third lies within it.
  const std::vector<VoxelRun> spans = rasterize(
      contours_of({rectangle(2, 1, 9, 2), rectangle(9, 1, 15, 2), rectangle(10, 1, 12, 2), rectangle(20, 1, 21, 3)}),
      lattice);
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_EQ(spans[0].begin, 2u);
  EXPECT_EQ(spans[0].end, 15u);
  EXPECT_EQ(spans[1].begin, 20u);
  EXPECT_EQ(spans[2].row, 2u);
}

TEST(Occupancy, OfSomeRowsIsThatOfTheWhole) {
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 30, .height = 20};
  const Contours contours = contours_of({{{2, 1}, {25, 3}, {28, 19}, {9, 12}}, rectangle(12, 5, 20, 9)});
  std::vector<VoxelRun> cut;
  for (const VoxelRun& span : rasterize(contours, lattice)) {
    if (span.row >= 4 && span.row < 11) cut.push_back(span);
  }
  const std::vector<VoxelRun> rows = rasterize(contours, lattice, {4, 11});
  ASSERT_EQ(rows.size(), cut.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].row, cut[i].row);
    EXPECT_EQ(rows[i].begin, cut[i].begin);
    EXPECT_EQ(rows[i].end, cut[i].end);
  }
}

// Held all at once, the crossings take 200 MB.
TEST(Occupancy, ManyTallLoopsAreHeldForSomeRowsAtATime) {
  constexpr std::uint32_t kWidth = 8, kHeight = 65'536;
  const LayerLattice lattice{.x0_mm = -0.5, .y0_mm = -0.5, .dx_mm = 1, .dy_mm = 1, .width = kWidth, .height = kHeight};
  std::mt19937 random(20261125);
  std::vector<Polygon> polygons;
  BitImage expected(kWidth, kHeight);
  for (int k = 0; k < 400; ++k) {
    const std::uint32_t left = random() % kWidth, bottom = random() % 32'768, top = bottom + random() % 32'768;
    const bool tall = k % 2 == 0;
    polygons.push_back(rectangle(left, tall ? 9 : bottom, left + 1, tall ? kHeight - 5 - k : top));
    if (tall && left % 2 == 0) polygons.pop_back();  // So that columns differ.
  }
  for (const Polygon& polygon : polygons) {
    const auto column = static_cast<std::uint32_t>(polygon[0].x());
    for (auto row = static_cast<std::uint32_t>(polygon[0].y()); row < polygon[2].y(); ++row) {
      expected.bits[row] |= static_cast<std::uint8_t>(0x80 >> column);
    }
  }
  const Contours contours = contours_of(polygons);
  const oracle::HeldMemory held;
  const std::vector<VoxelRun> spans = rasterize(contours, lattice);
  EXPECT_LT(held.most_bytes(), (16u << 20) + 2 * spans.capacity() * sizeof(VoxelRun));
  EXPECT_EQ(to_bit_image(spans, kWidth, kHeight).bits, expected.bits);
}

TEST(Occupancy, IsCancelledAmongTheRows) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const LayerLattice lattice{.x0_mm = 0, .y0_mm = 0, .dx_mm = 1, .dy_mm = 1, .width = 5, .height = 5};
  EXPECT_THROW(rasterize(contours_of({rectangle(1, 1, 3, 3)}), lattice, {}, cancel), Error);
}

TEST(Occupancy, BitImagesHoldEverySpan) {
  std::mt19937 random(20261121);
  for (int trial = 0; trial < 200; ++trial) {
    const std::uint32_t width = 1 + random() % 70;
    const std::uint32_t begin = random() % width, end = begin + 1 + random() % (width - begin);
    const BitImage image = to_bit_image(std::vector<VoxelRun>{{1, begin, end}}, width, 3);
    ASSERT_EQ(count(image), end - begin);
    for (std::uint32_t x = 0; x < width; ++x) ASSERT_EQ(image.get(x, 1), x >= begin && x < end);
    if (width % 8 == 0) continue;
    for (std::uint32_t row = 0; row < 3; ++row) {
      ASSERT_EQ(image.bits[image.row_bytes * (row + 1) - 1] & (0xff >> width % 8), 0);
    }
  }
}

/// Self-intersecting polygons, so that winding numbers other than 0 and 1 appear.
std::vector<Polygon> random_polygons(std::mt19937& random, int loops, const std::function<double()>& coordinate) {
  std::vector<Polygon> polygons(loops);
  for (Polygon& polygon : polygons) {
    polygon.resize(3 + random() % 20);
    for (Vec2& point : polygon) point = Vec2(coordinate(), coordinate());
  }
  return polygons;
}

TEST(OccupancyConsistency, AgreesWithTheWindingNumberAtEveryVoxelOfRandomPolygons) {
  std::mt19937 random(20261121);
  std::uniform_real_distribution<double> anywhere(-1, 11);
  const LayerLattice lattice{
      .x0_mm = 0.1, .y0_mm = -0.2, .dx_mm = 0.0846, .dy_mm = 0.0423, .width = 117, .height = 240};
  for (int trial = 0; trial < 30; ++trial) {
    const auto polygons = random_polygons(random, 1 + trial % 4, [&] { return anywhere(random); });
    EXPECT_EQ(differences(polygons, lattice, 1e-9), 0u) << "trial " << trial;
  }
}

TEST(OccupancyConsistency, AgreesExactlyWherePointsAndCentresCoincide) {
  std::mt19937 random(7);
  // Everything is a small multiple of 1/2: the winding number is computed without rounding, on edges too.
  const LayerLattice lattice{.x0_mm = -0.5, .y0_mm = -0.5, .dx_mm = 0.5, .dy_mm = 1, .width = 40, .height = 21};
  for (int trial = 0; trial < 100; ++trial) {
    const auto polygons = random_polygons(random, 1 + trial % 3, [&] { return static_cast<double>(random() % 20); });
    EXPECT_EQ(differences(polygons, lattice, 0), 0u) << "trial " << trial;
  }
}

}  // namespace
}  // namespace ccslice
