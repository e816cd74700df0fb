// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/pack_tray.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace ccslice::cli {
namespace {

struct Rectangle {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

std::vector<Rectangle> rectangles(const std::vector<Footprint>& footprints, const PackedTray& tray) {
  std::vector<Rectangle> all;
  for (std::size_t i = 0; i < footprints.size(); ++i) {
    const PackedPlace& at = tray.places[i];
    const double w = at.turned ? footprints[i].depth_mm : footprints[i].width_mm;
    const double d = at.turned ? footprints[i].width_mm : footprints[i].depth_mm;
    all.push_back({at.x_mm, at.y_mm, at.x_mm + w, at.y_mm + d});
  }
  return all;
}

/// Everything lies on the tray, and this far apart.
void expect_sound(const std::vector<Footprint>& footprints, const PackedTray& tray, double width, double clearance) {
  constexpr double kRounding = 1e-6;
  const std::vector<Rectangle> all = rectangles(footprints, tray);
  double depth = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_GE(all[i].x0, 0);
    EXPECT_GE(all[i].y0, 0);
    EXPECT_LE(all[i].x1, width + kRounding);
    depth = std::max(depth, all[i].y1);
    for (std::size_t k = 0; k < i; ++k) {
      const double apart =
          std::max({all[i].x0 - all[k].x1, all[k].x0 - all[i].x1, all[i].y0 - all[k].y1, all[k].y0 - all[i].y1});
      EXPECT_GE(apart, clearance - kRounding) << i << " and " << k;
    }
  }
  EXPECT_NEAR(tray.depth_mm, depth, kRounding);
}

TEST(PackTray, FillsATrayOfEqualSquaresToItsEdges) {
  const std::vector<Footprint> squares(12, {10, 10});
  const PackedTray tray = pack_tray(squares, 40, 0);
  expect_sound(squares, tray, 40, 0);
  EXPECT_DOUBLE_EQ(tray.depth_mm, 30);
}

TEST(PackTray, NeedsNoClearanceAtTheEdges) {
  const std::vector<Footprint> squares(4, {10, 10});
  const PackedTray tray = pack_tray(squares, 22, 2);
  expect_sound(squares, tray, 22, 2);
  EXPECT_DOUBLE_EQ(tray.depth_mm, 22);
}

TEST(PackTray, TurnsWhatFitsOnlySo) {
  const PackedTray tray = pack_tray({{50, 10}}, 20, 5);
  ASSERT_EQ(tray.places.size(), 1u);
  EXPECT_TRUE(tray.places[0].turned);
  EXPECT_DOUBLE_EQ(tray.depth_mm, 50);
}

TEST(PackTray, PacksNothing) { EXPECT_EQ(pack_tray({}, 10, 1).depth_mm, 0); }

TEST(PackTray, RandomPartsLieApartAndWasteLittle) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> side(5, 60), clearance(0, 5);
  for (int round = 0; round < 60; ++round) {
    std::vector<Footprint> parts(1 + static_cast<std::size_t>(round) * 3);
    double area = 0;
    const double apart = clearance(random);
    for (Footprint& part : parts) {
      part = {side(random), side(random)};
      area += (part.width_mm + apart) * (part.depth_mm + apart);
    }
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", round " + std::to_string(round));
    const PackedTray tray = pack_tray(parts, 300, apart);
    expect_sound(parts, tray, 300, apart);
    if (parts.size() > 60) {
      EXPECT_GT(area / (300 * tray.depth_mm), 0.8);
    }
  }
}

TEST(PackTray, ThousandsOfPartsTakeNoTime) {
  const std::vector<Footprint> parts(4096, {5, 7});
  const PackedTray tray = pack_tray(parts, 490, 0.5);
  EXPECT_LT(tray.depth_mm, 390);
}

}  // namespace
}  // namespace ccslice::cli
