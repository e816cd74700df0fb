// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Makes a program of operations in the order in which a parser meets them.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "core/formula/program.h"

namespace ccslice {

class ProgramBuilder {
 public:
  /// Values are numbered in the order in which they are made.
  using Value = std::uint16_t;

  Value constant(double value);
  /// REQUIRES: Op::kX, kY or kZ.
  Value coordinate(Op axis) { return made({axis, {}}); }
  Value input(std::uint16_t index) { return made({Op::kInput, {index, 0, 0}}); }

  Value apply(Op op, Value a) { return apply(op, {a, a, a}); }
  Value apply(Op op, Value a, Value b) { return apply(op, {a, b, a}); }
  Value apply(Op op, const std::array<Value, 3>& operands);
  /// Cheaper than Op::kPower for exponents that formulas often have, with no more error.
  Value power(Value base, Value exponent);

  /// The program whose result is the value.
  Program finish(Value result) const;

 private:
  struct Node {
    Op op;
    std::array<Value, 3> operands;

    auto operator<=>(const Node&) const = default;
  };
  /// A value is a constant or what a node makes.
  struct Entry {
    bool constant;
    std::uint16_t index;
  };

  Value made(const Node& node);
  Operand operand(Value value, const std::vector<std::uint16_t>& registers) const;
  std::vector<Value> last_uses(Value result) const;

  std::vector<Entry> entries_;
  std::vector<double> constants_;
  std::vector<Node> nodes_;
  std::map<std::uint64_t, Value> value_of_constant_;  // By its bits.
  std::map<Node, Value> value_of_node_;
};

}  // namespace ccslice
