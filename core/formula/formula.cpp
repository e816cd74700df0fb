// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula.h"

#include <utility>

#include "core/formula/formula_parser.h"
#include "core/formula/program_bounds.h"
#include "core/formula/run_program.h"

namespace ccslice {

Formula Formula::parse(std::string_view text, std::span<const std::string> channels) {
  ParsedFormula parsed = parse_formula(text, channels);
  Formula formula;
  formula.program_ = std::move(parsed.program);
  formula.inputs_ = std::move(parsed.inputs);
  formula.uses_place_ = parsed.uses_place;
  return formula;
}

Interval Formula::bounds(const Box3& box, std::span<const Interval> inputs) const {
  return program_bounds(program_, box, inputs);
}

void Formula::evaluate(const Vec3& first, const Vec3& step, std::uint32_t begin,
                       std::span<const std::span<const float>> inputs, std::span<float> values) const noexcept {
  run_program(program_, {first, step, begin}, inputs, values);
}

}  // namespace ccslice
