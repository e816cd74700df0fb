// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Compared with the C library's functions of long double, whose 64 bits tell errors to a thousandth of a unit in the
// last place. Nightly: 10^8 arguments of each.

#include "core/formula/elementary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <ostream>
#include <random>
#include <string>
#include <utility>

namespace ccslice {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Random = std::mt19937_64;
using Arguments = std::pair<double, double>;

/// Of the exact value, in units in the last place of doubles.
double error_of(double value, long double exact) {
  if (static_cast<double>(exact) == value) return 0.5;
  int exponent = 0;
  std::frexp(exact, &exponent);
  constexpr int kLeastExponent = -1021;
  const long double unit = std::ldexp(1.0L, std::max(exponent, kLeastExponent) - 53);
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact) / unit);
}

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
/// Of any size between two powers of two.
double any_size(Random& random, double low, double high) { return std::exp2(uniform(random, low, high)); }
double any_sign(Random& random, double size) { return (random() & 1) != 0 ? -size : size; }

/// Exactly so many quarters of a turn less than the turns given, so that nothing is lost near multiples of a half.
long double sine_of_turns(long double turns) {
  const long double halves = std::round(2 * turns);
  const long double sine = std::sin(2 * std::numbers::pi_v<long double> * (turns - halves / 2));
  return std::fmod(halves, 2.0L) == 0 ? sine : -sine;
}

struct Case {
  std::string name;
  std::function<Lanes(Lanes, Lanes)> function;
  std::function<long double(double, double)> exact;
  std::function<Arguments(Random&)> arguments;
  double bound = 1;  // Of the error.
};

std::ostream& operator<<(std::ostream& out, const Case& each) { return out << each.name; }

const auto kSineOf = [](Lanes x, Lanes) { return sine_cosine(x).sine; };
const auto kCosineOf = [](Lanes x, Lanes) { return sine_cosine(x).cosine; };
const auto kSineOfTurns = [](Lanes x, Lanes) { return sine_cosine_of_turns(x).sine; };
const auto kCosineOfTurns = [](Lanes x, Lanes) { return sine_cosine_of_turns(x).cosine; };
const auto kTangentOf = [](Lanes x, Lanes) { return tangent(x); };
const auto kExponentialOf = [](Lanes x, Lanes) { return exponential(x); };
const auto kLogarithmOf = [](Lanes x, Lanes) { return logarithm(x); };

const auto kNearby = [](Random& random) { return Arguments{uniform(random, -10, 10), 0}; };
const auto kFar = [](Random& random) { return Arguments{uniform(random, -1e5, 1e5), 0}; };
const auto kAnyAngle = [](Random& random) { return Arguments{any_sign(random, any_size(random, -60, 40)), 0}; };
/// The doubles nearest to multiples of a quarter of a turn, where sines and cosines are least.
const auto kQuarters = [](Random& random) {
  const double quarters = std::floor(any_size(random, 0, 39));
  return Arguments{static_cast<double>(static_cast<long double>(quarters) * std::numbers::pi_v<long double> / 2), 0};
};

const auto kSineExact = [](double x, double) { return std::sin(static_cast<long double>(x)); };
const auto kCosineExact = [](double x, double) { return std::cos(static_cast<long double>(x)); };
const auto kTangentExact = [](double x, double) { return std::tan(static_cast<long double>(x)); };
const auto kPowerExact = [](double x, double y) { return std::pow(static_cast<long double>(x), y); };
const auto kAngleExact = [](double y, double x) { return std::atan2(static_cast<long double>(y), x); };
const auto kExponentialExact = [](double x, double) { return std::exp(static_cast<long double>(x)); };
const auto kLogarithmExact = [](double x, double) { return std::log(static_cast<long double>(x)); };

const Case kCases[] = {
    {"Sine", kSineOf, kSineExact, kNearby},
    {"SineFar", kSineOf, kSineExact, kFar},
    {"SineOfAnySize", kSineOf, kSineExact, kAnyAngle},
    {"SineNearQuarters", kSineOf, kSineExact, kQuarters},
    {"Cosine", kCosineOf, kCosineExact, kNearby},
    {"CosineFar", kCosineOf, kCosineExact, kFar},
    {"CosineOfAnySize", kCosineOf, kCosineExact, kAnyAngle},
    {"CosineNearQuarters", kCosineOf, kCosineExact, kQuarters},
    {"SineOfTurns", kSineOfTurns, [](double x, double) { return sine_of_turns(x); }, kNearby},
    {"CosineOfTurns", kCosineOfTurns, [](double x, double) { return sine_of_turns(x + 0.25L); }, kNearby},
    {"Tangent", kTangentOf, kTangentExact, kNearby, 1.5},
    {"TangentOfAnySize", kTangentOf, kTangentExact, kAnyAngle, 1.5},
    {"TangentNearQuarters", kTangentOf, kTangentExact, kQuarters, 1.5},
    {"Exponential", kExponentialOf, kExponentialExact,
     [](Random& random) {
       return Arguments{uniform(random, -708, 709.7), 0};
     }},
    {"ExponentialSubnormal", kExponentialOf, kExponentialExact,
     [](Random& random) {
       return Arguments{uniform(random, -745, -708), 0};
     }},
    {"ExponentialOfLittle", kExponentialOf, kExponentialExact,
     [](Random& random) {
       return Arguments{any_sign(random, any_size(random, -60, 2)), 0};
     }},
    {"Logarithm", kLogarithmOf, kLogarithmExact,
     [](Random& random) {
       return Arguments{any_size(random, -1074, 1024), 0};
     }},
    {"LogarithmNearOne", kLogarithmOf, kLogarithmExact,
     [](Random& random) {
       return Arguments{1 + any_sign(random, any_size(random, -52, -1)), 0};
     }},
    {"Power", power, kPowerExact,
     [](Random& random) {
       return Arguments{uniform(random, 0.001, 100), uniform(random, -10, 10)};
     },
     1.5},
    {"PowerOfAnySize", power, kPowerExact,
     [](Random& random) {
       const double base = any_size(random, -1074, 1024);
       return Arguments{base, uniform(random, -708, 709.7) / std::log(base)};
     },
     1.5},
    {"PowerNearOne", power, kPowerExact,
     [](Random& random) {
       const double base = 1 + any_sign(random, any_size(random, -40, -2));
       return Arguments{base, uniform(random, -708, 709.7) / std::log(base)};
     },
     1.5},
    {"PowerOfNegative", power, kPowerExact,
     [](Random& random) {
       return Arguments{uniform(random, -20, -0.1), static_cast<double>(random() % 200) - 100};
     },
     1.5},
    {"Angle", angle_of, kAngleExact,
     [](Random& random) {
       return Arguments{uniform(random, -100, 100), uniform(random, -100, 100)};
     }},
    {"AngleOfAnySize", angle_of, kAngleExact,
     [](Random& random) {
       return Arguments{any_sign(random, any_size(random, -1074, 1024)),
                        any_sign(random, any_size(random, -1074, 1024))};
     }},
};

class ElementaryTest : public testing::TestWithParam<Case> {};

/// Fails where the error is not below its bound; the greatest one becomes a property of the test.
void compare(const Case& each, std::uint64_t arguments) {
  constexpr std::uint64_t kSeed = 20240611;
  Random random(kSeed);
  double greatest = 0;
  Arguments at;
  for (std::uint64_t i = 0; i < arguments; i += kLanes) {
    Lanes x{}, y{};
    for (std::size_t k = 0; k < kLanes; ++k) std::tie(x[k], y[k]) = each.arguments(random);
    const Lanes values = each.function(x, y);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const long double exact = each.exact(x[k], y[k]);
      if (std::abs(exact) > static_cast<long double>(std::numeric_limits<double>::max())) continue;
      const double error = error_of(values[k], exact);
      if (error <= greatest) continue;
      greatest = error;
      at = {x[k], y[k]};
    }
  }
  testing::Test::RecordProperty("greatest_error", std::to_string(greatest));
  EXPECT_LT(greatest, each.bound) << "at " << at.first << ", " << at.second << "; seed " << kSeed;
}

TEST_P(ElementaryTest, ErrsByLessThanItsBound) { compare(GetParam(), 500'000); }
TEST_P(ElementaryTest, ErrsByLessThanItsBoundNightly) { compare(GetParam(), 100'000'000); }

INSTANTIATE_TEST_SUITE_P(Functions, ElementaryTest, testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

Lanes all(double value) { return Lanes{} + value; }

TEST(Elementary, HasExactValues) {
  EXPECT_EQ(sine_cosine(all(0)).sine[0], 0);
  EXPECT_EQ(sine_cosine(all(0)).cosine[0], 1);
  EXPECT_EQ(exponential(all(0))[0], 1);
  EXPECT_EQ(logarithm(all(1))[0], 0);
  EXPECT_EQ(power(all(3), all(4))[0], 81);
  EXPECT_EQ(power(all(-2), all(3))[0], -8);
  EXPECT_EQ(power(all(-2), all(-2))[0], 0.25);
  for (int quarters = -8; quarters <= 8; ++quarters) {
    const SineCosine turned = sine_cosine_of_turns(all(quarters / 4.0));
    constexpr double kSines[] = {0, 1, 0, -1};
    EXPECT_EQ(turned.sine[0], kSines[(quarters + 8) % 4]);
    EXPECT_EQ(turned.cosine[0], kSines[(quarters + 9) % 4]);
  }
}

TEST(Elementary, HasThePeriodOneInTurns) {
  for (const double turns : {0.0625, -0.4375, 0.375, 0.984375}) {
    const SineCosine near = sine_cosine_of_turns(all(turns)), far = sine_cosine_of_turns(all(turns + 0x1p30));
    EXPECT_EQ(near.sine[1], far.sine[1]);
    EXPECT_EQ(near.cosine[1], far.cosine[1]);
  }
}

TEST(Elementary, CountsAnglesThatAreTooLargeAsZero) {
  for (const double angle : {2e12, -1e300, kInfinity, -kInfinity}) {
    EXPECT_EQ(sine_cosine(all(angle)).sine[2], 0);
    EXPECT_EQ(sine_cosine(all(angle)).cosine[2], 1);
    EXPECT_EQ(sine_cosine_of_turns(all(angle)).sine[2], 0);
    EXPECT_EQ(sine_cosine_of_turns(all(angle)).cosine[2], 1);
    EXPECT_EQ(tangent(all(angle))[2], 0);
  }
}

TEST(Elementary, GoesToLimits) {
  EXPECT_EQ(exponential(all(710))[0], kInfinity);
  EXPECT_EQ(exponential(all(kInfinity))[0], kInfinity);
  EXPECT_EQ(exponential(all(-746))[0], 0);
  EXPECT_EQ(exponential(all(-kInfinity))[0], 0);
  EXPECT_EQ(logarithm(all(kInfinity))[0], kInfinity);
  EXPECT_EQ(logarithm(all(std::numeric_limits<double>::max()))[0], 0x1.62e42fefa39efp+9);
  EXPECT_EQ(power(all(2), all(kInfinity))[0], kInfinity);
  EXPECT_EQ(power(all(0.5), all(kInfinity))[0], 0);
  EXPECT_EQ(power(all(2), all(-kInfinity))[0], 0);
  EXPECT_EQ(power(all(1), all(kInfinity))[0], 1);
  EXPECT_EQ(power(all(kInfinity), all(0.5))[0], kInfinity);
  EXPECT_EQ(power(all(kInfinity), all(-0.5))[0], 0);
  EXPECT_EQ(power(all(-kInfinity), all(3))[0], -kInfinity);
  EXPECT_EQ(angle_of(all(kInfinity), all(1))[0], std::numbers::pi / 2);
  EXPECT_EQ(angle_of(all(-1), all(-kInfinity))[0], -std::numbers::pi);
}

TEST(Elementary, IsZeroWhereItIsNotDefined) {
  EXPECT_EQ(logarithm(all(0))[0], 0);
  EXPECT_EQ(logarithm(all(-1))[0], 0);
  EXPECT_EQ(logarithm(all(-kInfinity))[0], 0);
  EXPECT_EQ(power(all(-2), all(0.5))[0], 0);
  EXPECT_EQ(power(all(0), all(-1))[0], 0);
  EXPECT_EQ(power(all(0), all(0.5))[0], 0);
  EXPECT_EQ(power(all(0), all(0))[0], 1);
  EXPECT_EQ(power(all(-kInfinity), all(0))[0], 1);
  EXPECT_EQ(angle_of(all(0), all(0))[0], 0);
}

TEST(Elementary, TurnsOnlyOneWayAtTheNegativeAxis) {
  for (const double zero : {0.0, -0.0}) {
    EXPECT_EQ(angle_of(all(zero), all(-1))[0], std::numbers::pi);
    EXPECT_EQ(angle_of(all(zero), all(1))[0], 0);
    EXPECT_EQ(angle_of(all(2), all(zero))[0], std::numbers::pi / 2);
    EXPECT_EQ(angle_of(all(-2), all(zero))[0], -std::numbers::pi / 2);
  }
}

}  // namespace
}  // namespace ccslice
