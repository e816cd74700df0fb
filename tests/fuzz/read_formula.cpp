// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Formulas from arbitrary bytes: a FormulaError, or values that are finite, lie within their bounds, and are the same
// for any split of a row.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/formula/formula.h"
#include "core/formula/formula_error.h"

namespace {

constexpr std::uint32_t kPoints = 70, kSplit = 33;

void sample(const ccslice::Formula& formula) {
  const ccslice::Vec3 first(-1, 0.5, 2), step(0.0625, 0, -0.125);
  ccslice::Box3 box(first);
  box.extend(ccslice::Vec3(first + static_cast<double>(kPoints) * step));
  std::vector<float> channel(kPoints);
  for (std::uint32_t k = 0; k < kPoints; ++k) channel[k] = static_cast<float>(k) / 8 - 4;
  const ccslice::Interval values_of_channel{-4, 5};
  const std::vector<ccslice::Interval> intervals(formula.inputs().size(), values_of_channel);
  const ccslice::Interval bounds = formula.bounds(box, intervals);

  std::vector<float> whole(kPoints, std::numeric_limits<float>::quiet_NaN()), parts = whole;
  const auto evaluate = [&](std::uint32_t begin, std::uint32_t end, std::vector<float>& values) {
    const std::span<const float> read = std::span(channel).subspan(begin, end - begin);
    const std::vector<std::span<const float>> inputs(formula.inputs().size(), read);
    formula.evaluate(first, step, begin, inputs, std::span(values).subspan(begin, end - begin));
  };
  evaluate(0, kPoints, whole);
  evaluate(0, kSplit, parts);
  evaluate(kSplit, kPoints, parts);
  for (std::uint32_t k = 0; k < kPoints; ++k) {
    if (!std::isfinite(whole[k]) || !bounds.contains(static_cast<double>(whole[k])) || whole[k] != parts[k]) {
      std::abort();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::string> channels = {"Core", "Shell thickness", "x"};
  try {
    sample(ccslice::Formula::parse(std::string_view(reinterpret_cast<const char*>(data), size), channels));
  } catch (const ccslice::FormulaError& error) {
    if (error.column() == 0) std::abort();
  }
  return 0;
}
