// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A formula: a value at each point of space, made of coordinates and of channels there. It is parsed once, to a program
// without loops or branches, and then takes about as long at each point.
//
// docs/fields.md has the language. Values are double until the last one, which is a float. They are the same to the
// bit on every machine (elementary.h), and whatever points they are asked for with.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/types.h"
#include "core/formula/formula_parser.h"
#include "core/formula/interval.h"
#include "core/formula/program.h"

namespace ccslice {

/// Longest text, most operators and calls in it, and how deep parentheses, calls, signs and powers may lie within each
/// other.
inline constexpr std::size_t kMaxFormulaBytes = 4096;
inline constexpr std::size_t kMaxFormulaOperations = 512;
inline constexpr std::size_t kMaxFormulaDepth = 64;

/// Immutable; safe to use from any thread.
class Formula {
 public:
  /// `channels`: names that the formula may read. Throws FormulaError (formula_error.h).
  static Formula parse(std::string_view text, std::span<const std::string> channels);

  /// Channels that it reads, in the order of first use.
  std::span<const std::string> inputs() const noexcept { return inputs_; }
  /// Distances that it reads, each once.
  std::span<const FormulaDistance> distances() const noexcept { return distances_; }
  /// It is a distance, and nothing else.
  bool is_distance() const noexcept;
  /// Whether it reads coordinates.
  bool uses_place() const noexcept { return uses_place_; }

  /// Bounds of what evaluate() gives, rounding included, where x, y and z (mm) lie in `box` and the inputs in `inputs`.
  /// Infinite on a side where none is found. REQUIRES: as many as inputs(); neither is empty.
  Interval bounds(const Box3& box, std::span<const Interval> inputs) const;

  /// values[k]: at the point first + (begin + k) * step, mm. `inputs`: values of inputs() there, in that order, and
  /// of distances() behind them; NaN counts as 0. All values are finite. REQUIRES: as many of each as values.
  void evaluate(const Vec3& first, const Vec3& step, std::uint32_t begin,
                std::span<const std::span<const float>> inputs, std::span<float> values) const noexcept;

 private:
  Formula() = default;

  Program program_;
  std::vector<std::string> inputs_;
  std::vector<FormulaDistance> distances_;
  bool uses_place_ = false;
};

}  // namespace ccslice
