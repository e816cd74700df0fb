// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/program_builder.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/base/lanes.h"
#include "core/formula/run_program.h"

namespace ccslice {

namespace {

/// Operands that count: constants that are none of them keep no register.
std::size_t operand_count(Op op) {
  if (op <= Op::kInput) return 0;
  if (op <= Op::kNot) return 1;
  return op <= Op::kOr ? 2 : 3;
}

}  // namespace

ProgramBuilder::Value ProgramBuilder::constant(double value) {
  const auto next = static_cast<Value>(entries_.size());
  const auto [found, is_new] = value_of_constant_.emplace(std::bit_cast<std::uint64_t>(value), next);
  if (is_new) {
    entries_.push_back({true, static_cast<std::uint16_t>(constants_.size())});
    constants_.push_back(value);
  }
  return found->second;
}

ProgramBuilder::Value ProgramBuilder::made(const Node& node) {
  const auto next = static_cast<Value>(entries_.size());
  const auto [found, is_new] = value_of_node_.emplace(node, next);
  if (is_new) {
    entries_.push_back({false, static_cast<std::uint16_t>(nodes_.size())});
    nodes_.push_back(node);
  }
  return found->second;
}

ProgramBuilder::Value ProgramBuilder::apply(Op op, const std::array<Value, 3>& operands) {
  if (op == Op::kMultiply && operands[0] == operands[1]) return apply(Op::kSquare, operands[0]);
  const auto is_constant = [this](Value value) { return entries_[value].constant; };
  if (std::ranges::all_of(operands, is_constant)) {
    const auto number = [this](Value value) { return constants_[entries_[value].index]; };
    return constant(folded(op, number(operands[0]), number(operands[1]), number(operands[2])));
  }
  return made({op, operands});
}

ProgramBuilder::Value ProgramBuilder::power(Value base, Value exponent) {
  if (entries_[exponent].constant) {
    const double times = constants_[entries_[exponent].index];
    if (times == 0.5) return apply(Op::kSquareRoot, base);
    if (times == 1) return base;
    if (times == 2) return apply(Op::kSquare, base);
    if (times == 3) return apply(Op::kMultiply, apply(Op::kSquare, base), base);
    if (times == 4) return apply(Op::kSquare, apply(Op::kSquare, base));
    if (times == -1) return apply(Op::kDivide, constant(1), base);
  }
  return apply(Op::kPower, base, exponent);
}

Operand ProgramBuilder::operand(Value value, const std::vector<std::uint16_t>& registers) const {
  const Entry& entry = entries_[value];
  return {entry.constant, entry.constant ? entry.index : registers[entry.index]};
}

std::vector<ProgramBuilder::Value> ProgramBuilder::last_uses(Value result) const {
  std::vector<Value> last(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    last[i] = static_cast<Value>(i);
    for (std::size_t k = 0; k < operand_count(nodes_[i].op); ++k) {
      const Entry& used = entries_[nodes_[i].operands[k]];
      if (!used.constant) last[used.index] = static_cast<Value>(i);
    }
  }
  if (!entries_[result].constant) last[entries_[result].index] = static_cast<Value>(nodes_.size());
  return last;
}

Program ProgramBuilder::finish(Value result) const {
  const std::vector<Value> last = last_uses(result);
  Program program;
  for (const double value : constants_) program.constants.insert(program.constants.end(), kLanes, value);
  std::vector<std::uint16_t> registers(nodes_.size()), free;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    Instruction instruction{node.op, 0, {}};
    if (node.op == Op::kInput) instruction.operands[0].index = node.operands[0];
    const std::size_t count = operand_count(node.op);
    for (std::size_t k = 0; k < count; ++k) instruction.operands[k] = operand(node.operands[k], registers);
    for (std::size_t k = count; count > 0 && k < 3; ++k) instruction.operands[k] = instruction.operands[0];
    // The result may lie where an operand did that isn't used any more.
    for (std::size_t k = 0; k < count; ++k) {
      const Entry& used = entries_[node.operands[k]];
      const bool again =
          std::find(node.operands.begin(), node.operands.begin() + k, node.operands[k]) != node.operands.begin() + k;
      if (!used.constant && !again && last[used.index] == i) free.push_back(registers[used.index]);
    }
    if (free.empty()) free.push_back(static_cast<std::uint16_t>(program.registers++));
    registers[i] = free.back();
    free.pop_back();
    instruction.result = registers[i];
    if (last[i] == i) free.push_back(registers[i]);
    program.instructions.push_back(instruction);
  }
  program.result = operand(result, registers);
  return program;
}

}  // namespace ccslice
