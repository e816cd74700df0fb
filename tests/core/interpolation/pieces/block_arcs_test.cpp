// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_arcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

namespace ccslice {
namespace {

constexpr std::uint32_t kArcSeed = 20261126;

/// Calls visit(arc, from, step, bends) for every chord of some random cubics, whose nodes are at 0 to 4.
template <typename Visit>
void visit_chords(Visit visit) {
  std::mt19937 random(kArcSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const std::array<double, 4> c = {unit(random), unit(random), unit(random), unit(random)};
    const auto arc = [&c](double x) { return ((c[3] * x + c[2]) * x + c[1]) * x + c[0]; };
    const auto bends = bends_of<double>([&](std::size_t n) { return arc(static_cast<double>(n)); });
    for (const std::size_t step : {1u, 2u, 4u}) {
      for (std::size_t from = 0; from < 4; from += step) visit(arc, from, step, bends);
    }
  }
}

TEST(BlockArcs, ChordsOfCubicsAreOffAsDifferencesSay) {
  visit_chords([](const auto& arc, std::size_t from, std::size_t step, const ArcBends<double>& bends) {
    const double middle = bends.middle(from, step), cubic = cubic_of(bends, step);
    const auto begin = static_cast<double>(from), length = static_cast<double>(step);
    double most = 0;
    for (int k = 0; k <= 1000; ++k) {
      const double t = k / 1000.0;
      const double off = (1 - t) * arc(begin) + t * arc(begin + length) - arc(begin + t * length);
      EXPECT_NEAR(off, t * (1 - t) * (4 * middle + cubic * (t - 0.5)), 1e-9) << "seed " << kArcSeed;
      most = std::max(most, off);
    }
    const HighestOverArc highest = highest_over_arc(middle, cubic);
    EXPECT_GE(highest.height, most - 1e-12) << "seed " << kArcSeed;
    EXPECT_LE(highest.height, most + 1e-4) << "seed " << kArcSeed;
    const double t = highest.share;
    if (most > 0) {
      EXPECT_NEAR(t * (1 - t) * (4 * middle + cubic * (t - 0.5)), highest.height, 1e-12) << "seed " << kArcSeed;
    }
  });
}

TEST(BlockArcs, FourAreAsOffAsEachOfThem) {
  std::mt19937 random(kArcSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto lanes = [&] { return Lanes{unit(random), 1e-9 * unit(random), unit(random), 0}; };
  for (int trial = 0; trial < 200; ++trial) {
    const ArcBends<Lanes> bends = {{lanes(), lanes(), lanes()}};
    for (const std::size_t step : {1u, 2u, 4u}) {
      const Lanes middle = bends.middle(0, step), cubic = cubic_of(bends, step);
      const HighestOverArcs highest = highest_over_arcs(middle, cubic);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const ArcBends<double> own = {{bends.at[0][lane], bends.at[1][lane], bends.at[2][lane]}};
        EXPECT_EQ(cubic[lane], cubic_of(own, step)) << "seed " << kArcSeed;
        const HighestOverArc one = highest_over_arc(middle[lane], cubic[lane]);
        EXPECT_EQ(highest.height[lane], one.height) << "seed " << kArcSeed;
        EXPECT_EQ(highest.share[lane], one.share) << "seed " << kArcSeed;
      }
    }
  }
}

TEST(BlockArcs, StraightLinesAreNowhereOff) {
  const auto bends = bends_of<double>([](std::size_t n) { return 2.0 * static_cast<double>(n); });
  EXPECT_EQ(bends.middle(0, 4), 0);
  EXPECT_EQ(cubic_of(bends, 4), 0);
  EXPECT_EQ(highest_over_arc(0, 0).height, 0);
}

}  // namespace
}  // namespace ccslice
