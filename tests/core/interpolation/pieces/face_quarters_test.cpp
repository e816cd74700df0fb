// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/face_quarters.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace ccslice {
namespace {

constexpr std::uint32_t kQuarterSeed = 20261127;

BlockPoints quarter_block() {
  std::mt19937 random(kQuarterSeed);
  std::uniform_real_distribution<double> unit(-100, 100);
  BlockPoints points;
  for (Vec3& point : points) point = Vec3(unit(random), unit(random), unit(random));
  return points;
}

Vec3 lane_of(const LanePoints& points, std::size_t lane) { return {points.x[lane], points.y[lane], points.z[lane]}; }

/// Of a quarter: its first node along s and along t.
std::size_t first_s(std::size_t lane) { return lane % 2 * 2; }
std::size_t first_t(std::size_t lane) { return lane / 2 * 2; }

template <std::size_t Size>
void expect_corners(const BlockPoints& points, const BlockFace& face) {
  constexpr bool kWhole = Size == 4;
  for (std::size_t t = 0; t < (kWhole ? 1 : 3 - Size); ++t) {
    for (std::size_t s = 0; s < (kWhole ? 1 : 3 - Size); ++s) {
      FaceQuarters(points, face).with_corners<Size>(s, t, [&](const auto&... corners) {
        const std::array<LanePoints, 4> found = {corners...};
        for (std::size_t corner = 0; corner < found.size(); ++corner) {
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const std::size_t from_s = kWhole ? 0 : s + first_s(lane), from_t = kWhole ? 0 : t + first_t(lane);
            EXPECT_EQ(lane_of(found[corner], lane),
                      points[face.node(from_s + corner % 2 * Size, from_t + corner / 2 * Size)])
                << Size << " " << s << " " << t;
          }
        }
      });
    }
  }
}

TEST(FaceQuarters, KnowTheirNodesAndTheFaces) {
  const BlockPoints points = quarter_block();
  for (std::size_t side = 0; side < 6; ++side) {
    const BlockFace face(side / 2, side % 2);
    expect_corners<1>(points, face);
    expect_corners<2>(points, face);
    expect_corners<4>(points, face);
  }
}

TEST(FaceQuarters, KnowTheWholeArcsThroughTheirNodes) {
  const BlockPoints points = quarter_block();
  for (std::size_t side = 0; side < 6; ++side) {
    const BlockFace face(side / 2, side % 2);
    const FaceQuarters quarters(points, face);
    for (std::size_t n = 0; n < FaceQuarters::kNodes; ++n) {
      const ArcBends<LanePoints> along_s = quarters.along_s(n), along_t = quarters.along_t(n);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto of_s = bends_of<Vec3>([&](std::size_t s) { return points[face.node(s, n + first_t(lane))]; });
        const auto of_t = bends_of<Vec3>([&](std::size_t t) { return points[face.node(n + first_s(lane), t)]; });
        for (std::size_t k = 0; k < of_s.at.size(); ++k) {
          EXPECT_EQ(lane_of(along_s.at[k], lane), of_s.at[k]) << "side " << side << " lane " << lane;
          EXPECT_EQ(lane_of(along_t.at[k], lane), of_t.at[k]) << "side " << side << " lane " << lane;
        }
      }
    }
  }
}

/// As each lane's arc says by itself.
template <std::size_t Step>
void expect_middles(const ArcBends<Lanes>& bends) {
  for (std::size_t half = 0; half < (Step == 1 ? 2 : 1); ++half) {
    const Lanes of_s = middles<Step>(bends, FaceQuarters::at_end_of_s(), half),
                of_t = middles<Step>(bends, FaceQuarters::at_end_of_t(), half);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const ArcBends<double> own = {{bends.at[0][lane], bends.at[1][lane], bends.at[2][lane]}};
      EXPECT_EQ(of_s[lane], own.middle(Step > 2 ? 0 : first_s(lane) + half, Step)) << Step << " " << half;
      EXPECT_EQ(of_t[lane], own.middle(Step > 2 ? 0 : first_t(lane) + half, Step)) << Step << " " << half;
    }
  }
}

TEST(FaceQuarters, ChordsAreThoseOfTheirOwnPartOfAnArc) {
  const FaceQuarters quarters(quarter_block(), BlockFace(1, 1));
  const LanePoints row = {Lanes{1, -2, 3, 4}, Lanes{5, 6, -7, 8}, Lanes{9, 10, 11, -12}};
  const ArcBends<LanePoints> arcs = quarters.along_s(1);
  const ArcBends<Lanes> bends = across(row, arcs);
  for (std::size_t k = 0; k < bends.at.size(); ++k) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      EXPECT_EQ(bends.at[k][lane], lane_of(row, lane).dot(lane_of(arcs.at[k], lane)));
    }
  }
  expect_middles<1>(bends);
  expect_middles<2>(bends);
  expect_middles<4>(bends);
}

}  // namespace
}  // namespace ccslice
