// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula.h"

#include <cmath>
#include <limits>
#include <utility>

#include "core/formula/program_bounds.h"
#include "core/formula/run_program.h"

namespace ccslice {

Formula Formula::parse(std::string_view text, std::span<const std::string> channels) {
  ParsedFormula parsed = parse_formula(text, channels);
  Formula formula;
  formula.program_ = std::move(parsed.program);
  formula.inputs_ = std::move(parsed.inputs);
  formula.distances_ = std::move(parsed.distances);
  formula.uses_place_ = parsed.uses_place;
  return formula;
}

bool Formula::is_distance() const noexcept {
  return program_.instructions.size() == 1 && inputs_.empty() && !distances_.empty();
}

Interval Formula::bounds(const Box3& box, std::span<const Interval> inputs) const {
  std::vector<Interval> all(inputs.begin(), inputs.end());
  for (const FormulaDistance& distance : distances_) {
    all.push_back({0, std::nextafter(static_cast<float>(distance.reach_mm), std::numeric_limits<float>::max())});
  }
  return program_bounds(program_, box, all);
}

void Formula::evaluate(const Vec3& first, const Vec3& step, std::uint32_t begin,
                       std::span<const std::span<const float>> inputs, std::span<float> values) const noexcept {
  run_program(program_, {first, step, begin}, inputs, values);
}

}  // namespace ccslice
