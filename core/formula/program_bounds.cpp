// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/program_bounds.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/base/lanes.h"
#include "core/formula/interval_operations.h"

namespace ccslice {

namespace {

/// As values are rounded to floats, but for what is beyond them.
double as_float(double bound) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<double>(static_cast<float>(std::min(std::max(bound, -kLargest), kLargest)));
}

}  // namespace

Interval program_bounds(const Program& program, const Box3& box, std::span<const Interval> inputs) {
  std::vector<Interval> registers(program.registers);
  const auto read = [&](const Operand& operand) {
    const double* const constant = program.constants.data() + operand.index * kLanes;
    return operand.constant ? Interval{*constant, *constant} : registers[operand.index];
  };
  const auto made = [&](const Instruction& instruction) {
    if (instruction.op == Op::kInput) return inputs[instruction.operands[0].index];
    const auto axis = static_cast<int>(instruction.op);
    if (instruction.op < Op::kInput) return Interval{box.min()[axis], box.max()[axis]};
    return on_intervals(instruction.op, read(instruction.operands[0]), read(instruction.operands[1]),
                        read(instruction.operands[2]));
  };
  for (const Instruction& instruction : program.instructions) registers[instruction.result] = made(instruction);
  const Interval result = read(program.result);
  constexpr double kInfinite = std::numeric_limits<double>::infinity(), kLargest = std::numeric_limits<float>::max();
  return {result.low < -kLargest ? -kInfinite : as_float(result.low),
          result.high > kLargest ? kInfinite : as_float(result.high)};
}

}  // namespace ccslice
