// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/net_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "core/base/types.h"
#include "core/limit/patch.h"

namespace ccslice {
namespace {

Vec3 lane_of(const PointLanes& p, std::size_t lane) { return {p.x[lane], p.y[lane], p.z[lane]}; }

void set_lane(const Vec3& from, std::size_t lane, PointLanes& to) {
  to.x[lane] = static_cast<float>(from.x());
  to.y[lane] = static_cast<float>(from.y());
  to.z[lane] = static_cast<float>(from.z());
}

std::vector<PointLanes> random_grid(std::size_t points, std::mt19937& random) {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<PointLanes> grid(points);
  for (PointLanes& p : grid) {
    for (std::size_t n = 0; n < kFloatLanes; ++n) {
      set_lane({coordinate(random), coordinate(random), coordinate(random)}, n, p);
    }
  }
  return grid;
}

/// Boxes around columns of each lane's matrix, each entry of which may differ by `radius`.
std::array<BoxLanes, 3> boxes_around(const std::array<Mat3, kFloatLanes>& centres, double radius) {
  std::array<BoxLanes, 3> columns;
  for (std::size_t c = 0; c < 3; ++c) {
    PointLanes low, high;
    for (std::size_t n = 0; n < kFloatLanes; ++n) {
      const Vec3 centre = centres[n].col(static_cast<Eigen::Index>(c));
      set_lane(centre - Vec3::Constant(radius), n, low);
      set_lane(centre + Vec3::Constant(radius), n, high);
    }
    columns[c].extend(low);
    columns[c].extend(high);
  }
  return columns;
}

TEST(NetLanes, FindsBoxesProperWhoseMatricesAre) {
  std::mt19937 random(1);
  std::normal_distribution<double> entry;
  std::size_t proper = 0, refused = 0;
  for (int run = 0; run < 400; ++run) {
    std::array<Mat3, kFloatLanes> centres;
    for (Mat3& m : centres) m = Mat3::NullaryExpr([&] { return entry(random); });
    const double radius = 0.0005 * run;
    const unsigned lanes = proper_lanes(boxes_around(centres, radius));
    for (std::size_t n = 0; n < kFloatLanes; ++n) {
      double least = 1e300;  // A determinant is least where each entry is as far off as it may be.
      for (std::uint32_t corner = 0; corner < 512; ++corner) {
        Mat3 m = centres[n];
        for (int e = 0; e < 9; ++e) m.data()[e] += (corner >> e & 1) != 0 ? radius : -radius;
        least = std::min(least, m.determinant());
      }
      if (lanes >> n & 1) {
        EXPECT_GT(least, 0) << "run " << run << ", lane " << n;
        ++proper;
      } else {
        ++refused;
      }
    }
  }
  EXPECT_GT(proper, 300u);
  EXPECT_GT(refused, 1000u);
}

TEST(NetLanes, RefusesMirroredSingularAndUnlimitedBoxes) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<Mat3, kFloatLanes> centres;
  centres.fill(Mat3::Identity());
  centres[1] = -Mat3::Identity();
  centres[2].col(2) = centres[2].col(1);
  centres[3].setZero();
  centres[4](0, 0) = kInfinity;
  centres[5](0, 0) = std::numeric_limits<double>::quiet_NaN();
  centres[6](1, 1) = 1e-6;  // As thin as the box is thick.
  EXPECT_EQ(proper_lanes(boxes_around(centres, 1e-6)), 0b10000001u);
  std::array<BoxLanes, 3> grown = boxes_around(centres, 1e-6);
  grown[0].grow(BoxLanes::kHuge);
  EXPECT_EQ(proper_lanes(grown), 0u);
  EXPECT_EQ(proper_lanes({}), 0u) << "boxes that hold nothing";
}

/// Phantoms and Bezier points are those of patch.h, along one, two and three axes.
TEST(NetLanes, MakesNetsAsPatchesDo) {
  std::mt19937 random(2);
  for (const int axes : {1, 2, 3}) {
    const std::size_t points = std::size_t{1} << (2 * axes);
    for (PhantomMask phantoms = 0; phantoms < 1 << (2 * axes); ++phantoms) {
      std::vector<PointLanes> grid = random_grid(points, random);
      std::array<std::vector<double>, kFloatLanes> expected;
      for (std::size_t n = 0; n < kFloatLanes; ++n) {
        for (const PointLanes& p : grid) {
          const Vec3 point = lane_of(p, n);
          expected[n].insert(expected[n].end(), point.begin(), point.end());
        }
        fill_phantoms(expected[n].data(), axes, 3, phantoms);
        bspline_to_bezier(expected[n].data(), axes, 3);
      }
      fill_phantoms(grid, phantoms);
      bspline_to_bezier(grid);
      for (std::size_t n = 0; n < kFloatLanes; ++n) {
        for (std::size_t p = 0; p < points; ++p) {
          EXPECT_LT((lane_of(grid[p], n) - Vec3::Map(&expected[n][3 * p])).norm(), 2e-5);
        }
      }
    }
  }
}

TEST(NetLanes, BoxesHoldDifferencesAlongTheirAxes) {
  std::mt19937 random(3);
  const std::vector<PointLanes> net = random_grid(64, random);
  std::array<BoxLanes, 3> columns;
  extend_by_differences(net, columns);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t step = std::size_t{1} << (2 * axis);
    BoxLanes expected;
    for (std::size_t p = 0; p < 64; ++p) {
      if (p / step % 4 != 3) expected.extend(net[p + step] - net[p]);
    }
    for (std::size_t n = 0; n < kFloatLanes; ++n) {
      EXPECT_EQ(lane_of(columns[axis].low, n), lane_of(expected.low, n));
      EXPECT_EQ(lane_of(columns[axis].high, n), lane_of(expected.high, n));
    }
  }
}

}  // namespace
}  // namespace ccslice
