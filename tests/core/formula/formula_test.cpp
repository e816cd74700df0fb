// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const std::vector<std::string> kChannels = {"Core", "Shell thickness", "x", "sin", "a\"b"};

/// At the point (1.5, -2, 0.25), with Core 0.25, "Shell thickness" 3 and all other channels 7.
float value(const std::string& text) {
  const Formula formula = Formula::parse(text, kChannels);
  std::vector<float> read;
  for (const std::string& name : formula.inputs()) read.push_back(name == "Core" ? 0.25F : name.size() > 5 ? 3 : 7);
  std::vector<std::span<const float>> inputs;
  for (const float& each : read) inputs.emplace_back(&each, 1);
  float result = std::numeric_limits<float>::quiet_NaN();
  formula.evaluate(Vec3(1.5, -2, 0.25), Vec3(0, 0, 0), 0, inputs, {&result, 1});
  return result;
}

TEST(Formula, BindsAsMathematicsDoes) {
  EXPECT_EQ(value("1 + 2 * 3"), 7);
  EXPECT_EQ(value("(1 + 2) * 3"), 9);
  EXPECT_EQ(value("7 - 2 - 1"), 4);
  EXPECT_EQ(value("8 / 4 / 2"), 1);
  EXPECT_EQ(value("-3 ^ 2"), -9);
  EXPECT_EQ(value("2 ^ 3 ^ 2"), 512);
  EXPECT_EQ(value("2 ^ -1"), 0.5);
  EXPECT_EQ(value("2 * -3"), -6);
  EXPECT_EQ(value("- -3"), 3);
  EXPECT_EQ(value("1 + 1 < 3"), 1);
  EXPECT_EQ(value("1 or 0 and 0"), 1);
  EXPECT_EQ(value("not 1 or 1"), 1);
  EXPECT_EQ(value("not 1 > 2"), 1);
  EXPECT_EQ(value("!3 + 2"), 2);
  EXPECT_EQ(value("1 && 0 || 1"), 1);
}

TEST(Formula, ReadsNumbersInEveryNotation) {
  EXPECT_EQ(value("12"), 12);
  EXPECT_EQ(value(".5"), 0.5);
  EXPECT_EQ(value("2."), 2);
  EXPECT_EQ(value("1.25e2"), 125);
  EXPECT_EQ(value("5E-1"), 0.5);
  EXPECT_EQ(value("1e+2"), 100);
  EXPECT_EQ(value(" \t\n 1 \r\n"), 1);
}

TEST(Formula, ReadsCoordinates) {
  EXPECT_EQ(value("x"), 1.5);
  EXPECT_EQ(value("y"), -2);
  EXPECT_EQ(value("z"), 0.25);
  EXPECT_EQ(value("r"), 2.5);
  EXPECT_EQ(value("theta"), std::atan2(-2.0F, 1.5F));
  EXPECT_EQ(value("pi"), std::numbers::pi_v<float>);
  EXPECT_TRUE(Formula::parse("theta", kChannels).uses_place());
  EXPECT_FALSE(Formula::parse("Core + pi", kChannels).uses_place());
  EXPECT_TRUE(Formula::parse("distance(2)", kChannels).is_distance());
  EXPECT_TRUE(Formula::parse("(distance(2))", kChannels).is_distance());
  for (const char* text : {"distance(2) + 1", "-distance(2)", "Core", "x", "2", "distance(2) - distance(1)"}) {
    EXPECT_FALSE(Formula::parse(text, kChannels).is_distance()) << text;
  }
}

TEST(Formula, ReadsChannels) {
  EXPECT_EQ(value("Core"), 0.25);
  EXPECT_EQ(value("\"Core\""), 0.25);
  EXPECT_EQ(value("\"Shell thickness\""), 3);
  EXPECT_EQ(value("\"a\"\"b\""), 7);
  EXPECT_EQ(value("\"x\" + x"), 8.5) << "what isn't in double quotes is the coordinate";
  EXPECT_EQ(value("\"sin\" + sin(0)"), 7);
  EXPECT_THAT(Formula::parse("\"x\" + x * Core - \"x\"", kChannels).inputs(), ElementsAre("x", "Core"));
  EXPECT_THAT(Formula::parse("x", kChannels).inputs(), IsEmpty());
}

TEST(Formula, Compares) {
  EXPECT_EQ(value("1 < 2"), 1);
  EXPECT_EQ(value("2 < 2"), 0);
  EXPECT_EQ(value("2 <= 2"), 1);
  EXPECT_EQ(value("2 > 1"), 1);
  EXPECT_EQ(value("2 > 2"), 0);
  EXPECT_EQ(value("2 >= 2"), 1);
  EXPECT_EQ(value("2 == 2"), 1);
  EXPECT_EQ(value("2 != 2"), 0);
  EXPECT_EQ(value("if(x > 1, 10, 20)"), 10);
  EXPECT_EQ(value("if(x < 1, 10, 20)"), 20);
  EXPECT_EQ(value("if(-0.5, 10, 20)"), 10) << "all but 0 is true";
}

TEST(Formula, CallsFunctions) {
  EXPECT_EQ(value("min(3, 1, 2)"), 1);
  EXPECT_EQ(value("max(3, 1, 4, 2)"), 4);
  EXPECT_EQ(value("clamp(x, 2, 3)"), 2);
  EXPECT_EQ(value("abs(y)"), 2);
  EXPECT_EQ(value("floor(-1.5)"), -2);
  EXPECT_EQ(value("mod(7.5, 2)"), 1.5);
  EXPECT_EQ(value("mod(-0.5, 2)"), 1.5);
  EXPECT_EQ(value("mod(0.5, -2)"), -1.5);
  EXPECT_EQ(value("sqrt(6.25)"), 2.5);
  EXPECT_EQ(value("exp(1)"), std::numbers::e_v<float>);
  EXPECT_EQ(value("log(exp(2))"), 2);
  EXPECT_EQ(value("sin(pi / 2) + cos(0)"), 2);
  EXPECT_FLOAT_EQ(value("tan(pi / 4)"), 1);
  EXPECT_EQ(value("atan2(1, -1)"), static_cast<float>(0.75 * std::numbers::pi));
  EXPECT_EQ(value("smoothstep(0, 2, 1)"), 0.5);
  EXPECT_EQ(value("smoothstep(0, 4, 1)"), 0.15625);
  EXPECT_EQ(value("smoothstep(2, 0, 3)"), 0) << "edges may be swapped";
  EXPECT_EQ(value("smoothstep(1, 1, 0.5) + 10 * smoothstep(1, 1, 1)"), 10) << "a step where they are one";
}

TEST(Formula, RaisesToPowers) {
  EXPECT_EQ(value("y ^ 2"), 4);
  EXPECT_EQ(value("y ^ 3"), -8);
  EXPECT_EQ(value("y ^ 4"), 16);
  EXPECT_EQ(value("y ^ 5"), -32);
  EXPECT_EQ(value("y ^ -1"), -0.5);
  EXPECT_EQ(value("y ^ 1"), -2);
  EXPECT_EQ(value("y ^ 0"), 1);
  EXPECT_EQ(value("6.25 ^ 0.5"), 2.5);
  EXPECT_EQ(value("x ^ y"), static_cast<float>(1 / 2.25));
}

TEST(Formula, GivesZeroForWhatIsNotDefined) {
  for (const char* const text : {"1 / 0",
                                 "0 / 0",
                                 "-1 / 0",
                                 "x / (x - x)",
                                 "sqrt(-1)",
                                 "log(0)",
                                 "log(-1)",
                                 "(-2) ^ 0.5",
                                 "y ^ 0.5",
                                 "y ^ 1.5",
                                 "0 ^ -1",
                                 "(x - 1.5) ^ y",
                                 "mod(x, 0)",
                                 "atan2(0, 0)",
                                 "1e300 * 1e300 - 1e300 * 1e300",
                                 "0 * exp(1e9)",
                                 "exp(1e9) / exp(1e9)",
                                 "mod(exp(1e9), 3)",
                                 "mod(1, exp(1e9))",
                                 "smoothstep(-exp(1e9), exp(1e9), exp(1e9))"}) {
    EXPECT_EQ(value(text), 0) << text;
  }
}

TEST(Formula, IsFinite) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  EXPECT_EQ(value("1e300"), kLargest);
  EXPECT_EQ(value("-1e300"), -kLargest);
  EXPECT_EQ(value("exp(1e9)"), kLargest);
  EXPECT_EQ(value("-exp(x * 1e9)"), -kLargest);
  EXPECT_EQ(value("1e9 * 1e9 * x"), 1.5e18F);
}

TEST(Formula, CountsInputsThatAreNoNumbersAsZero) {
  const Formula formula = Formula::parse("Core + 1", kChannels);
  const std::vector<float> core = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()};
  const std::span<const float> inputs[] = {core};
  float values[2];
  formula.evaluate(Vec3(0, 0, 0), Vec3(0, 0, 0), 0, inputs, values);
  EXPECT_THAT(values, ElementsAre(1, std::numeric_limits<float>::max()));
}

/// Formulas of every kind of operation.
const char* const kSamples[] = {"x",
                                "Core * x + y",
                                "gyroid(x, y, z) > Core and r < 3",
                                "if(mod(x, 1) < 0.5, sin(3 * x), exp(-r) * theta)",
                                "smoothstep(0, 1, diamond(x, Core, z) ^ 2.5) / (1 + bcc(x, y, z) ^ 2)",
                                "7"};

TEST(Formula, GivesTheSameBytesForAnySplitOfARow) {
  constexpr std::uint32_t kCount = 300;
  std::mt19937 random(5);
  std::vector<float> core(kCount);
  for (float& each : core) each = std::uniform_real_distribution<float>(-1, 1)(random);
  const Vec3 first(-3.1, 0.7, 2.3), step(0.0213, 0.001, -0.0107);
  for (const char* const text : kSamples) {
    const Formula formula = Formula::parse(text, kChannels);
    const auto sample = [&](std::uint32_t begin, std::uint32_t end, std::span<float> values) {
      const std::vector<std::span<const float>> inputs(formula.inputs().size(),
                                                       std::span(core).subspan(begin, end - begin));
      formula.evaluate(first, step, 1000 + begin, inputs, values.subspan(begin, end - begin));
    };
    std::vector<float> whole(kCount), parts(kCount);
    sample(0, kCount, whole);
    for (std::uint32_t begin = 0, end = 0; begin < kCount; begin = end) {
      end = std::min<std::uint32_t>(kCount, begin + 1 + random() % 90);
      sample(begin, end, parts);
    }
    EXPECT_EQ(whole, parts) << text;
  }
}

TEST(Formula, HasItsPointsWhereRowsHaveThem) {
  const Vec3 first(-3.1, 0.7, 2.3), step(0.0213, 0.001, -0.0107);
  const std::uint32_t begin = 123456;
  float values[67];
  Formula::parse("y * 1e3", {}).evaluate(first, step, begin, {}, values);
  for (std::uint32_t k = 0; k < 67; ++k) {
    const Vec3 point = first + static_cast<double>(begin + k) * step;
    EXPECT_EQ(values[k], static_cast<float>(point.y() * 1e3));
  }
}

/// As deep and as many as may be.
std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

TEST(Formula, TakesAsMuchAsItsLimitsAllow) {
  EXPECT_EQ(value(repeated("(", 64) + "x" + repeated(")", 64)), 1.5);
  EXPECT_EQ(value("0" + repeated("+1", 512)), 512);
  EXPECT_EQ(value(repeated(" ", kMaxFormulaBytes - 1) + "1"), 1);
}

TEST(Formula, KeepsManyValuesAtOnce) {
  // All terms are made before the first one is read for the second time.
  constexpr int kTerms = 100;
  std::string there = "0", back = "0";
  double expected = 0;
  for (int i = 0; i < kTerms; ++i) {
    const std::string term = "(x+" + std::to_string(i) + ")";
    there += "+" + term;
    back += "-2*" + term;
    expected -= 1.5 + i;
  }
  const Formula formula = Formula::parse(there + "+(" + back + ")", kChannels);
  std::vector<float> values(100);
  formula.evaluate(Vec3(1.5, 0, 0), Vec3(0, 0, 0), 0, {}, values);
  for (const float each : values) EXPECT_EQ(each, static_cast<float>(expected));
}

}  // namespace
}  // namespace ccslice
