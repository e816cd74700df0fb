// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/block_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace ccslice {
namespace {

/// A polynomial of a degree along each of three axes, by powers.
template <std::size_t kDegree>
class TensorPolynomial {
 public:
  TensorPolynomial(std::mt19937& random, double linear, double bent) {
    std::uniform_real_distribution<double> u(-1, 1);
    for (std::size_t n = 0; n < powers_.size(); ++n) {
      const std::size_t degree = n % kPowers + n / kPowers % kPowers + n / (kPowers * kPowers);
      powers_[n] = (degree <= 1 ? linear : bent) * u(random);
    }
  }
  double operator()(const Vec3& at) const {
    double value = 0;
    for (std::size_t k = kPowers; k-- > 0;) {
      double layer = 0;
      for (std::size_t j = kPowers; j-- > 0;) {
        double row = 0;
        for (std::size_t i = kPowers; i-- > 0;) row = row * at.x() + powers_[i + kPowers * (j + kPowers * k)];
        layer = layer * at.y() + row;
      }
      value = value * at.z() + layer;
    }
    return value;
  }

 private:
  static constexpr std::size_t kPowers = kDegree + 1;
  std::array<double, kPowers * kPowers * kPowers> powers_;
};

/// A block of random shape, its channel and a cubic, with parameters from -1 to 1.
template <std::size_t kDegree>
struct CaseOfDegree {
  using Tensor = TensorPolynomial<kDegree>;
  std::array<Tensor, 3> position;
  Tensor channel;
  CubicPolynomial cubic;

  CaseOfDegree(std::mt19937& random, double bent)
      : position{Tensor(random, 0.4, bent), Tensor(random, 0.4, bent), Tensor(random, 0.4, bent)},
        channel(random, 1, 0.3) {
    std::uniform_real_distribution<double> u(-1, 1);
    for (double& coefficient : cubic) coefficient = u(random);
  }

  Vec3 place(const Vec3& at) const { return {position[0](at), position[1](at), position[2](at)}; }
  double error(const Vec3& at) const { return channel(at) - value_at(cubic, place(at)); }

  double bound(double beyond, double enough) const {
    std::array<BlockValues, 3> places{};
    BlockValues errors{};
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const Vec3 at = node(n);
      const std::size_t group = block_slot(n) / kLanes, lane = block_slot(n) % kLanes;
      for (std::size_t a = 0; a < 3; ++a) places[a][group][lane] = place(at)[static_cast<Eigen::Index>(a)];
      errors[group][lane] = error(at);
    }
    BlockBound bound;
    bound.set_places(places, beyond, kDegree == 3 ? PlaceDegree::kThree : PlaceDegree::kFour);
    return bound(cubic, errors, enough);
  }

  double largest(double beyond, int steps) const {
    double most = 0;
    for (int n = 0; n < (steps + 1) * (steps + 1) * (steps + 1); ++n) {
      const Vec3 share(n % (steps + 1), n / (steps + 1) % (steps + 1), n / (steps + 1) / (steps + 1));
      most = std::max(most, std::abs(error((1 + 2 * beyond) * (2.0 / steps * share - Vec3::Ones()))));
    }
    return most;
  }

  static Vec3 node(std::size_t n) {
    return Vec3(n % kBlockNodes, n / kBlockNodes % kBlockNodes, n / kBlockNodes / kBlockNodes) / 2 - Vec3::Ones();
  }
};

using Case = CaseOfDegree<3>;

TEST(BlockBound, CoefficientsAreThoseOfChebyshevPolynomials) {
  const auto t = [](std::size_t degree, double x) { return std::cos(static_cast<double>(degree) * std::acos(x)); };
  for (std::size_t term = 0; term < std::tuple_size_v<BlockPoints>; ++term) {
    const std::size_t i = term % kBlockNodes, j = term / kBlockNodes % kBlockNodes,
                      k = term / kBlockNodes / kBlockNodes;
    BlockGrid grid{};
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const Vec3 at = Case::node(n);
      const std::size_t column = n % kBlockNodes;
      grid[n / kBlockNodes][column / kLanes][column % kLanes] = t(i, at.x()) * t(j, at.y()) * t(k, at.z());
    }
    to_chebyshev(grid);
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const std::size_t column = n % kBlockNodes;
      ASSERT_NEAR(grid[n / kBlockNodes][column / kLanes][column % kLanes], n == term ? 1 : 0, 1e-14)
          << term << " " << n;
    }
  }
}

template <std::size_t kDegree>
void expect_nothing_larger_between_nodes() {
  std::mt19937 random(1);
  for (int round = 0; round < 20; ++round) {
    for (const double bent : {0.0, 0.01, 0.1, 0.5}) {
      for (const double beyond : {0.0, 0.02, 0.1}) {
        const CaseOfDegree<kDegree> c(random, bent);
        const double largest = c.largest(beyond, 12);
        EXPECT_GE(c.bound(beyond, std::numeric_limits<double>::infinity()), largest) << "bent " << bent;
        EXPECT_GT(c.bound(beyond, 0.99 * largest), 0.99 * largest) << "bent " << bent;
        EXPECT_GE(c.bound(beyond, largest), largest) << "bent " << bent;
      }
    }
  }
}

TEST(BlockBound, NothingBetweenTheNodesIsLarger) { expect_nothing_larger_between_nodes<3>(); }
TEST(BlockBound, NothingBetweenTheNodesIsLargerOfPlacesOfDegreeFour) { expect_nothing_larger_between_nodes<4>(); }

// What interpolation at the nodes leaves of products of T_k, one, two or three of them, for which the bound counts.
TEST(BlockBound, LeavesNoMoreOutThanItCounts) {
  constexpr std::array<double, kBlockDegrees> kCounted = {0, 0, 0, 0, 0, 1.82, 4.75, 1.91, 2, 1.54, 1.82, 1.96, 2};
  const auto t = [](std::size_t degree, double angle) { return std::cos(static_cast<double>(degree) * angle); };
  const auto seen = [&](std::size_t degree, double angle) {  // What T_k is taken for.
    if (degree == 6) return 1 + t(2, angle) - t(4, angle);
    constexpr std::array<std::size_t, kBlockDegrees> kTakenFor = {0, 1, 2, 3, 4, 1, 0, 1, 4, 3, 2, 1, 0};
    return t(kTakenFor[degree], angle);
  };
  const double pi = std::acos(-1.0);
  for (std::size_t degree = 0; degree < kBlockDegrees; ++degree) {
    for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      EXPECT_NEAR(t(degree, std::acos(x)), seen(degree, std::acos(x)), 1e-13) << degree << " at " << x;
    }
  }
  std::mt19937 random(4);
  std::uniform_real_distribution<double> angle(0, pi);
  std::uniform_int_distribution<std::size_t> any(0, kBlockDegrees - 1);
  for (int round = 0; round < 400000; ++round) {
    const std::array<std::size_t, 3> degrees =
        round % 4 == 0 ? std::array<std::size_t, 3>{6, 6, 6} : std::array{any(random), any(random), any(random)};
    double whole = 1, taken = 1, counted = degrees == std::array<std::size_t, 3>{6, 6, 6} ? 9 : 0;
    for (const std::size_t degree : degrees) {
      const double at = angle(random);
      whole *= t(degree, at);
      taken *= seen(degree, at);
      counted += kCounted[degree];
    }
    ASSERT_LE(std::abs(whole - taken), counted + 1e-12) << degrees[0] << " " << degrees[1] << " " << degrees[2];
  }
}

// As it comes in practice: a cubic that is fitted leaves terms of degree 4 and more.
TEST(BlockBound, IsNearTheLargestErrorWhereTheBlockIsHardlyBent) {
  std::mt19937 random(2);
  for (int round = 0; round < 100; ++round) {
    Case c(random, 0.003);
    c.cubic.fill(0);
    c.cubic[0] = 0.5;
    c.cubic[10] = 1;
    const double largest = c.largest(0, 12), bound = c.bound(0, 1.1 * largest);
    EXPECT_LT(bound, 4 * largest);
  }
}

TEST(BlockBound, LooksCloserOnlyIfThatMayBeEnough) {
  std::mt19937 random(3);
  int tighter = 0;
  for (int round = 0; round < 100; ++round) {
    const Case c(random, 0.001);
    const double loose = c.bound(0, std::numeric_limits<double>::infinity());
    const double tight = c.bound(0, 0.8 * loose);
    EXPECT_LE(tight, loose);
    tighter += tight < 0.9 * loose;
  }
  EXPECT_GT(tighter, 10);
}

// At five equidistant nodes T_5 is T_1: of x^5 nothing but its degree tells.
TEST(BlockBound, SeesWhatVanishesAtTheNodes) {
  std::array<BlockValues, 3> places{};
  BlockValues errors{};
  for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
    const Vec3 at = Case::node(n);
    const double x = at.x() + 0.1 * at.x() * at.x() * at.x();
    places[0][block_slot(n) / kLanes][block_slot(n) % kLanes] = x;
    errors[block_slot(n) / kLanes][block_slot(n) % kLanes] =
        0;  // As if the channel were what interpolation takes x^2 for.
  }
  BlockBound bound;
  bound.set_places(places, 0);
  CubicPolynomial square{};
  square[16] = 1;
  EXPECT_GT(bound(square, errors, 0), 1e-4);
  CubicPolynomial linear{};
  linear[10] = 1;
  EXPECT_EQ(bound(linear, errors, 1), 0);
}

}  // namespace
}  // namespace ccslice
