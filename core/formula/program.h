// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a formula is parsed to: operations on values, one after the other, each made of earlier ones. A value is a
// double at each point. Constants are folded, and what is written twice is computed once.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ccslice {

enum class Op : std::uint8_t {
  // What is read: coordinates of the point, mm, and an input.
  kX,
  kY,
  kZ,
  kInput,  // operands[0]: its index.
  // Of one value:
  kNegate,
  kAbsolute,
  kFloor,
  kSquare,
  kSquareRoot,
  kExponential,
  kLogarithm,
  kSine,
  kCosine,
  kTangent,
  kNot,
  // Of two values:
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kModulo,
  kPower,
  kMinimum,
  kMaximum,
  kAngle,  // Of y and x.
  kLess,
  kLessOrEqual,
  kEqual,
  kUnequal,
  kAnd,
  kOr,
  // Of three values:
  kIf,
  kClamp,
  kSmoothstep,
  kGyroid,
  kDiamond,
  kSchwarz,
  kBcc,
};

/// A value: the number of a register, or of a constant.
struct Operand {
  bool constant = false;
  std::uint16_t index = 0;

  bool operator==(const Operand&) const = default;
};

/// Operands that the operation doesn't have are those of its first one.
struct Instruction {
  Op op;
  std::uint16_t result;  // A register; it may be that of an operand.
  std::array<Operand, 3> operands;
};

/// Immutable once built (program_builder.h).
struct Program {
  std::vector<Instruction> instructions;
  std::vector<double> constants;  // Each kLanes times, so that it is read as other values are.
  std::size_t registers = 0;
  Operand result;
};

}  // namespace ccslice
