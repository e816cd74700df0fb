// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A program at the points of a row, some of them at once (DEFAULT: 64), so that what an operation leaves stays in the
// nearest cache for the next one. Each point's value depends on the point alone, not on those beside it.
//
// No value is ever NaN: an operation that isn't defined gives 0, as Blender's math nodes do ("Division by zero results
// in zero": docs.blender.org/manual, Math Node; source/blender/blenlib/intern/math_base_safe_inline.c), and so does one
// whose limit depends on the way there, such as infinity - infinity.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/types.h"
#include "core/formula/program.h"

namespace ccslice {

/// More values than a program needs at once, for those have to be made by some of 512 operations and be read by others.
inline constexpr std::size_t kMaxRegisters = 1024;

/// Point k is first + (begin + k) * step.
struct ProgramPoints {
  Vec3 first, step;
  std::uint32_t begin;
};

/// values[k]: at point k, infinities as the largest float. `inputs`: values of inputs at the same points; NaN counts as
/// 0. REQUIRES: as many of each as values.
void run_program(const Program& program, const ProgramPoints& points, std::span<const std::span<const float>> inputs,
                 std::span<float> values) noexcept;

/// What an operation makes of constants, to the bit. REQUIRES: the operation reads nothing but values.
double folded(Op op, double a, double b, double c) noexcept;

}  // namespace ccslice
