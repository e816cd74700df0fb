// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/block_fitter.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>

namespace ccslice {
namespace {

using Map = std::function<Vec3(const Vec3&)>;  // Of parameters in [-1, 1]^3.
using Function = std::function<double(const Vec3&)>;

Vec3 parameter(std::size_t node) {
  Vec3 result;
  for (int a = 0; a < 3; ++a) {
    result[a] = static_cast<double>(node / kBlockStride[static_cast<std::size_t>(a)] % kBlockNodes) / 2 - 1;
  }
  return result;
}

/// A block of f over a map's image.
struct Block {
  std::array<BlockValues, 3> places;
  BlockValues values;

  Block(const Map& map, const Function& f) {
    const std::size_t last = std::tuple_size_v<BlockPoints> - 1;
    for (std::size_t slot = 0; slot < kBlockSlots; ++slot) put(slot, last - slot / (kBlockSlots / 2), map, f);
    for (std::size_t node = 0; node <= last; ++node) put(block_slot(node), node, map, f);
  }
  void put(std::size_t slot, std::size_t node, const Map& map, const Function& f) {
    const Vec3 place = map(parameter(node));
    for (int a = 0; a < 3; ++a) places[static_cast<std::size_t>(a)][slot / kLanes][slot % kLanes] = place[a];
    values[slot / kLanes][slot % kLanes] = f(place);
  }
};

Vec3 twisted(const Vec3& p) {
  return {0.8 * p.x() + 0.1 * p.y() * p.z(), 0.7 * p.y() - 0.2 * p.x() * p.x(), 0.75 * p.z() + 0.1 * p.x() * p.y()};
}

Vec3 straight(const Vec3& p) { return p; }

double cubic(const Vec3& p) {
  return 0.3 - p.x() + 2 * p.y() * p.z() + 0.5 * p.x() * p.x() * p.y() - p.z() * p.z() * p.z();
}

TEST(BlockFitter, ReproducesCubics) {
  const Block block(twisted, cubic);
  BlockFitter fitter;
  CubicPolynomial polynomial;
  fitter.factorize(block.places);
  EXPECT_LT(fitter.fit(block.values, polynomial), 1e-8);
  const Vec3 at(0.13, -0.4, 0.55);
  const auto c = along_row(polynomial, at.y(), at.z());
  EXPECT_NEAR(((c[3] * at.x() + c[2]) * at.x() + c[1]) * at.x() + c[0], cubic(at), 1e-7);
}

TEST(BlockFitter, SeesWhatACubicMisses) {
  for (int a = 0; a < 3; ++a) {
    const auto quartic = [a](const Vec3& p) { return cubic(p) + std::pow(p[a], 4); };
    const Block block(straight, quartic);
    BlockFitter fitter;
    CubicPolynomial polynomial;
    fitter.factorize(block.places);
    const double error = fitter.fit(block.values, polynomial);
    EXPECT_GT(error, 0.1);  // The best cubic is off by 1/8.
    EXPECT_LT(error, 0.3);
    for (const double times : {1.5, 100.0, 1e9}) EXPECT_EQ(fitter.axes_to_halve(times), 1u << a);
  }
}

TEST(BlockFitter, HalvesAllAxesOfWhatBendsAlike) {
  const Block block(straight, [](const Vec3& p) { return p.array().pow(4).sum(); });
  BlockFitter fitter;
  CubicPolynomial polynomial;
  fitter.factorize(block.places);
  fitter.fit(block.values, polynomial);
  EXPECT_EQ(fitter.axes_to_halve(100), 7u);
}

TEST(BlockFitter, HalvesTheFewestAxesThatAreEnough) {
  const auto axes_for = [](double error) {
    // Halving along x leaves 1/4 of the first term, along y too 1/16. Along z it gains nothing but for the second one.
    const Block block(straight,
                      [](const Vec3& p) { return p.x() * p.x() * p.y() * p.y() + 1e-4 * std::pow(p.z(), 4); });
    BlockFitter fitter;
    CubicPolynomial polynomial;
    fitter.factorize(block.places);
    fitter.fit(block.values, polynomial);
    return fitter.axes_to_halve(error);
  };
  EXPECT_EQ(std::popcount(axes_for(1.5)), 1);
  EXPECT_NE(axes_for(1.5), 4u);
  EXPECT_EQ(axes_for(6), 3u);
  EXPECT_EQ(axes_for(100), 3u);
}

TEST(BlockFitter, HalvesAllAxesOfWhatShowsNone) {
  const Block block(straight, cubic);
  BlockFitter fitter;
  CubicPolynomial polynomial;
  fitter.factorize(block.places);
  BlockValues same{};
  fitter.fit(same, polynomial);
  EXPECT_EQ(fitter.axes_to_halve(2), 7u);
}

TEST(BlockFitter, BearsPlacesInAPlane) {
  const Block block([](const Vec3& p) { return Vec3(p.x(), p.y(), 0); }, cubic);
  BlockFitter fitter;
  CubicPolynomial polynomial;
  fitter.factorize(block.places);
  EXPECT_LT(fitter.fit(block.values, polynomial), 1e-6);
}

TEST(BlockFitter, ConstantsComeOutExactlyHoweverThinTheBlock) {
  for (const double thickness : {1.0, 1e-3, 1e-6, 0.0}) {
    const auto shell = [thickness](const Vec3& p) {
      return Vec3((1 - thickness * (1 + p.z())) * std::sin(p.x()), p.y(),
                  (1 - thickness * (1 + p.z())) * std::cos(p.x()));
    };
    for (const double constant : {0.0, 0.1, 1e6 + 1.0 / 3}) {
      const Block block(shell, [constant](const Vec3&) { return constant; });
      BlockFitter fitter;
      CubicPolynomial polynomial, expected{constant};
      fitter.factorize(block.places);
      EXPECT_EQ(fitter.fit(block.values, polynomial), 0) << thickness << " " << constant;
      EXPECT_EQ(polynomial, expected) << thickness << " " << constant;
    }
  }
}

// The polynomial isn't determined by much. What a ridge leaves of it is a share of differences, not of values.
TEST(BlockFitter, AnOffsetTakesNothingFromTheFit) {
  const auto shell = [](const Vec3& p) {
    return Vec3((1 - 1e-4 * (1 + p.z())) * std::sin(p.x()), p.y(), (1 - 1e-4 * (1 + p.z())) * std::cos(p.x()));
  };
  constexpr double kOffset = 1 << 20;
  const auto error_of = [&](double offset) {
    const Block block(shell, [offset](const Vec3& p) { return offset + p.x() * p.y(); });
    BlockFitter fitter;
    CubicPolynomial polynomial;
    fitter.factorize(block.places);
    return fitter.fit(block.values, polynomial);
  };
  EXPECT_NEAR(error_of(kOffset), error_of(0), 1e-9);
}

TEST(BlockFitter, RefusesWhatIsNotANumber) {
  Block block(straight, cubic);
  block.values[3][2] = std::numeric_limits<double>::quiet_NaN();
  BlockFitter fitter;
  CubicPolynomial polynomial;
  fitter.factorize(block.places);
  EXPECT_EQ(fitter.fit(block.values, polynomial), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace ccslice
