// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/program_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/formula/formula.h"
#include "tests/core/formula/random_formula.h"

namespace ccslice {
namespace {

constexpr double kNoBound = std::numeric_limits<double>::infinity();

/// For x, y and z within [-1, 2], and a channel Core within [0, 1].
Interval bounds(const std::string& text) {
  const std::vector<std::string> channels = {"Core"};
  const Formula formula = Formula::parse(text, channels);
  const std::vector<Interval> inputs(formula.inputs().size(), Interval{0, 1});
  return formula.bounds(Box3(Vec3(-1, -1, -1), Vec3(2, 2, 2)), inputs);
}

TEST(ProgramBounds, AreTight) {
  EXPECT_EQ(bounds("3"), (Interval{3, 3}));
  EXPECT_EQ(bounds("x"), (Interval{-1, 2}));
  EXPECT_EQ(bounds("Core * 10 - 2"), (Interval{-2, 8}));
  EXPECT_EQ(bounds("x * x"), (Interval{0, 4}));
  EXPECT_EQ(bounds("x ^ 2"), (Interval{0, 4}));
  EXPECT_EQ(bounds("sqrt(x ^ 2 + y ^ 2 + 1)"), (Interval{1, 3}));
  EXPECT_EQ(bounds("r"), (Interval{0, static_cast<float>(std::sqrt(8.0))}));
  EXPECT_EQ(bounds("clamp(100 * x, 0, 5)"), (Interval{0, 5}));
  EXPECT_EQ(bounds("x > 3"), (Interval{0, 0}));
  EXPECT_EQ(bounds("if(x < 3, 5, y)"), (Interval{5, 5}));
  EXPECT_EQ(bounds("smoothstep(0, 1, x)"), (Interval{0, 1}));
  EXPECT_EQ(bounds("sin(10 * x)"), (Interval{-1, 1}));
  EXPECT_EQ(bounds("mod(x, 0.5)"), (Interval{0, 0.5}));
  EXPECT_EQ(bounds("gyroid(x, y, z)"), (Interval{-1.5, 1.5}));
  EXPECT_EQ(bounds("1 / x"), (Interval{-kNoBound, kNoBound}));
  EXPECT_EQ(bounds("1 / (x + 2)"), (Interval{0.25, 1}));
}

TEST(ProgramBounds, HoldEveryValue) {
  constexpr std::uint64_t kSeed = 77;
  std::mt19937_64 random(kSeed);
  int finite = 0;
  for (int i = 0; i < 20000; ++i) {
    const RandomFormula random_one = random_formula(random, 1 + i % 4);
    const Formula formula = Formula::parse(random_one.text, kRandomChannels);
    const FormulaPlace one = random_place(random), other = random_place(random);
    // Any two corners, or a point.
    const FormulaPlace two = i % 7 == 0 ? one : other;
    Box3 box;
    box.extend(Vec3(one.x, one.y, one.z));
    box.extend(Vec3(two.x, two.y, two.z));
    std::vector<Interval> inputs;
    for (const std::string& name : formula.inputs()) {
      const auto [low, high] = name == "a" ? std::minmax({one.a, two.a}) : std::minmax({one.b, two.b});
      inputs.push_back({low, high});
    }
    const Interval held = formula.bounds(box, inputs);
    ASSERT_LE(held.low, held.high);
    finite += std::isfinite(held.low) && std::isfinite(held.high) ? 1 : 0;
    for (int k = 0; k < 20; ++k) {
      const auto between = [&](double low, double high) {
        const auto which = random() % 4;
        if (which < 2) return which == 0 ? low : high;
        return std::uniform_real_distribution<double>(low, std::nextafter(high, kNoBound))(random);
      };
      Vec3 point;
      for (int axis = 0; axis < 3; ++axis) {
        point[axis] = std::min(between(box.min()[axis], box.max()[axis]), box.max()[axis]);
      }
      std::vector<float> read;
      for (const Interval& each : inputs) read.push_back(static_cast<float>(between(each.low, each.high)));
      std::vector<std::span<const float>> spans;
      for (const float& each : read) spans.emplace_back(&each, 1);
      float value = 0;
      formula.evaluate(point, Vec3(0, 0, 0), 0, spans, {&value, 1});
      ASSERT_TRUE(held.contains(static_cast<double>(value))) << random_one.text << " is " << value << ", outside of ["
                                                             << held.low << ", " << held.high << "]; seed " << kSeed;
    }
  }
  EXPECT_GT(finite, 10000) << "bounds are of use";
}

}  // namespace
}  // namespace ccslice
