// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/lattices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace ccslice {
namespace {

using Lattice = Lanes (*)(Lanes, Lanes, Lanes) noexcept;

double at(Lattice lattice, double u, double v, double w) { return lattice(Lanes{} + u, Lanes{} + v, Lanes{} + w)[0]; }

void expect_range(Lattice lattice, double low, double high) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-2, 2);
  double least = 0, greatest = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double value = at(lattice, any(random), any(random), any(random));
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  EXPECT_GE(least, low - 1e-12);
  EXPECT_LE(greatest, high + 1e-12);
  EXPECT_NEAR(least, low, 0.02);
  EXPECT_NEAR(greatest, high, 0.02);
}

TEST(Lattices, TakeTheirWholeRanges) {
  expect_range(gyroid, -1.5, 1.5);
  expect_range(diamond, -std::numbers::sqrt2, std::numbers::sqrt2);
  expect_range(schwarz, -3, 3);
  expect_range(bcc, -5, 3);
}

TEST(Lattices, HaveThePeriodOne) {
  for (const Lattice lattice : {gyroid, diamond, schwarz, bcc}) {
    const double value = at(lattice, 0.125, 0.3125, 0.78125);
    EXPECT_NE(value, 0);
    EXPECT_EQ(at(lattice, 1.125, 0.3125, 0.78125), value);
    EXPECT_EQ(at(lattice, 0.125, -3.6875, 0.78125), value);
    EXPECT_EQ(at(lattice, 0.125, 0.3125, 1e6 + 0.78125), value);
  }
}

TEST(Lattices, HaveTheirSymmetries) {
  EXPECT_EQ(at(gyroid, 0.1, 0.2, 0.3), at(gyroid, 0.2, 0.3, 0.1)) << "cyclic";
  EXPECT_NEAR(at(diamond, 0.1, 0.2, 0.3), at(diamond, 0.2, 0.1, 0.3), 1e-15) << "any order";
  EXPECT_EQ(at(schwarz, 0, 0, 0), 3);
  EXPECT_EQ(at(schwarz, 0.5, 0.5, 0.5), -3);
}

TEST(Lattices, HaveTheStrutsOfTheBodyCentredCubicLattice) {
  for (const double along : {0.0, 0.1, 0.25, 0.4}) {
    EXPECT_NEAR(at(bcc, along, along, along), 3, 1e-14);
    EXPECT_NEAR(at(bcc, along, -along, along), 3, 1e-14);
  }
  EXPECT_EQ(at(bcc, 0.5, 0, 0), -5);
}

}  // namespace
}  // namespace ccslice
