// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/formula/formula_parser.h"
#include "tests/core/formula/random_formula.h"

namespace ccslice {
namespace {

float run_at(const ParsedFormula& parsed, const FormulaPlace& at) {
  std::vector<float> read;
  for (const std::string& name : parsed.inputs) read.push_back(static_cast<float>(name == "a" ? at.a : at.b));
  std::vector<std::span<const float>> inputs;
  for (const float& each : read) inputs.emplace_back(&each, 1);
  float result = std::numeric_limits<float>::quiet_NaN();
  run_program(parsed.program, {Vec3(at.x, at.y, at.z), Vec3(0, 0, 0), 0}, inputs, {&result, 1});
  return result;
}

float as_value(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kLargest, kLargest));
}

bool alike(float a, float b) { return std::abs(a - b) <= 1e-5F * std::max(std::abs(a), std::abs(b)) + 1e-9F; }

TEST(RunProgram, AgreesWithAnotherEvaluator) {
  constexpr std::uint64_t kSeed = 31;
  std::mt19937_64 random(kSeed);
  int compared = 0, undecided = 0;
  for (int i = 0; i < 4000; ++i) {
    const RandomFormula formula = random_formula(random, 1 + i % 5);
    const ParsedFormula parsed = parse_formula(formula.text, kRandomChannels);
    for (int k = 0; k < 5; ++k) {
      const FormulaPlace at = random_place(random);
      const float ours = run_at(parsed, at);
      ASSERT_TRUE(std::isfinite(ours)) << formula.text;
      const float exact = as_value(formula.value(at, 1));
      // Where a rounding of an elementary function decides.
      const float more = as_value(formula.value(at, 1 + 1e-12)), less = as_value(formula.value(at, 1 - 1e-12));
      const bool decided = alike(exact, more) && alike(exact, less);
      ++(decided ? compared : undecided);
      if (decided) {
        ASSERT_TRUE(alike(ours, exact)) << formula.text << " at " << at.x << " " << at.y << " " << at.z << ", a "
                                        << at.a << ", b " << at.b << ": " << ours << ", not " << exact << "; seed "
                                        << kSeed;
      }
    }
  }
  EXPECT_GT(compared, 20 * undecided);
}

TEST(RunProgram, FoldsConstantsToTheSameBits) {
  std::mt19937_64 random(8);
  const std::vector<std::string> functions = {"sin(%)", "exp(%)", "%^1.7", "log(%)", "tan(%)/3", "gyroid(%,0.3,%)"};
  for (const std::string& function : functions) {
    const double number = std::uniform_real_distribution<double>(0, 5)(random);
    const auto with = [&](const std::string& argument) {
      std::string text = function;
      for (std::size_t at = text.find('%'); at != std::string::npos; at = text.find('%')) text.replace(at, 1, argument);
      return parse_formula("1e7*(" + text + ")", {}).program;
    };
    char digits[40];
    std::snprintf(digits, sizeof digits, "%.17g", number);
    float constant = 0, varying = 1;
    run_program(with(digits), {Vec3(0, 0, 0), Vec3(0, 0, 0), 0}, {}, {&constant, 1});
    run_program(with("x"), {Vec3(number, 0, 0), Vec3(0, 0, 0), 0}, {}, {&varying, 1});
    EXPECT_EQ(constant, varying) << function;
  }
}

}  // namespace
}  // namespace ccslice
