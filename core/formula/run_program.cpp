// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/run_program.h"

#include <algorithm>
#include <limits>

#include "core/base/lanes.h"
#include "core/formula/operations.h"

namespace ccslice {

namespace {

/// Doubles of all registers together: what the nearest cache holds. A block is as long as they allow.
constexpr std::size_t kScratch = 4096;
constexpr std::size_t kLongestBlock = 64;
static_assert(kMaxRegisters * kLanes <= kScratch);

/// Where four numbers of a value are, and from them to the next four.
struct Source {
  const double* at;
  std::size_t step;
};

/// Points of a row that are worked on together.
struct Block {
  const Program& program;
  const ProgramPoints& points;
  std::span<const std::span<const float>> inputs;
  std::uint32_t begin, count;  // Points of the row, from points.begin on.
  std::size_t length;          // The same in whole lanes.
  double* registers;
  const double* constants;

  double* at(std::uint16_t index) const noexcept { return registers + index * length; }
  Source source(const Operand& operand) const noexcept {
    if (operand.constant) return {constants + operand.index * kLanes, 0};
    return {at(operand.index), kLanes};
  }
};

/// As SourceRow::world() has it, to the bit: numbers of points are exact.
void read_coordinate(const Block& block, int axis, double* result) noexcept {
  const Lanes first = Lanes{} + block.points.first[axis], step = Lanes{} + block.points.step[axis];
  Lanes number = Lanes{0, 1, 2, 3} + (static_cast<double>(block.points.begin) + static_cast<double>(block.begin));
  for (std::size_t i = 0; i < block.length; i += kLanes) {
    store_unaligned(defined(first + number * step), result + i);
    number += static_cast<double>(kLanes);
  }
}

void read_input(const Block& block, std::size_t input, double* result) noexcept {
  const float* const values = block.inputs[input].data() + block.begin;
  const std::size_t whole = block.count / kLanes * kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) {
    store_unaligned(defined(_mm256_cvtps_pd(_mm_loadu_ps(values + i))), result + i);
  }
  for (std::size_t i = whole; i < block.length; ++i) {
    const double value = i < block.count ? static_cast<double>(values[i]) : 0;
    result[i] = value == value ? value : 0;
  }
}

void run_instruction(const Block& block, const Instruction& instruction) noexcept {
  double* const result = block.at(instruction.result);
  if (instruction.op == Op::kInput) return read_input(block, instruction.operands[0].index, result);
  if (instruction.op < Op::kInput) return read_coordinate(block, static_cast<int>(instruction.op), result);
  Source a = block.source(instruction.operands[0]), b = block.source(instruction.operands[1]),
         c = block.source(instruction.operands[2]);
  with_operation(instruction.op, [&](const auto& operation) {
    for (std::size_t i = 0; i < block.length; i += kLanes) {
      store_unaligned(operation(load_unaligned(a.at), load_unaligned(b.at), load_unaligned(c.at)), result + i);
      a.at += a.step;
      b.at += b.step;
      c.at += c.step;
    }
  });
}

/// As floats.
void write_values(const Block& block, float* values) noexcept {
  constexpr double kLargest = std::numeric_limits<float>::max();
  Source result = block.source(block.program.result);
  const std::size_t whole = block.count / kLanes * kLanes;
  for (std::size_t i = 0; i < block.length; i += kLanes) {
    const Lanes value = lesser(greater(load_unaligned(result.at), Lanes{} - kLargest), Lanes{} + kLargest);
    const __m128 rounded = _mm256_cvtpd_ps(value);
    if (i < whole) {
      _mm_storeu_ps(values + i, rounded);
    } else {
      float last[kLanes];
      _mm_storeu_ps(last, rounded);
      std::copy_n(last, block.count - whole, values + whole);
    }
    result.at += result.step;
  }
}

void run_block(const Block& block, float* values) noexcept {
  for (const Instruction& instruction : block.program.instructions) run_instruction(block, instruction);
  write_values(block, values);
}

}  // namespace

void run_program(const Program& program, const ProgramPoints& points, std::span<const std::span<const float>> inputs,
                 std::span<float> values) noexcept {
  alignas(Lanes) double registers[kScratch];
  const std::size_t room = kScratch / std::max<std::size_t>(program.registers, 1) / kLanes * kLanes;
  const std::size_t longest = std::min(kLongestBlock, room);
  for (std::size_t begin = 0; begin < values.size(); begin += longest) {
    const std::size_t count = std::min(longest, values.size() - begin);
    const std::size_t length = (count + kLanes - 1) / kLanes * kLanes;
    const Block block{program,
                      points,
                      inputs,
                      static_cast<std::uint32_t>(begin),
                      static_cast<std::uint32_t>(count),
                      length,
                      registers,
                      program.constants.data()};
    run_block(block, values.data() + begin);
  }
}

double folded(Op op, double a, double b, double c) noexcept {
  Lanes result{};
  with_operation(op, [&](const auto& operation) { result = operation(Lanes{} + a, Lanes{} + b, Lanes{} + c); });
  return result[0];
}

}  // namespace ccslice
