// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the operations of a program are, of four points at once. No result is NaN (run_program.h).

#pragma once

#include "core/base/lanes.h"
#include "core/formula/elementary.h"
#include "core/formula/lattices.h"
#include "core/formula/program.h"

namespace ccslice {

/// 0 in the place of NaN.
inline Lanes defined(Lanes value) noexcept { return value == value ? value : Lanes{}; }

/// 1 where the comparison holds, 0 elsewhere.
template <typename Comparison>
Lanes truth(Comparison holds) noexcept {
  return holds ? Lanes{} + 1.0 : Lanes{};
}

inline Lanes quotient(Lanes a, Lanes b) noexcept {
  const Lanes value = a / b;
  return (b != 0.0) & (value == value) ? value : Lanes{};
}

/// What is left of `a` once multiples of `b` are taken away: from 0 to b, with the sign of b. 0 where b is 0, and where
/// there are too many multiples to tell.
inline Lanes modulus(Lanes a, Lanes b) noexcept {
  constexpr double kMostMultiples = 0x1p53;
  const Lanes multiples = _mm256_floor_pd(a / b);
  const Lanes rest = multiply_add(-multiples, b, a);
  // The quotient may have been rounded to the next integer.
  const Lanes value = ((rest < 0.0) & (b > 0.0)) | ((rest > 0.0) & (b < 0.0)) ? rest + b : rest;
  return (b != 0.0) & (absolute(multiples) < kMostMultiples) & (value == value) ? value : Lanes{};
}

/// 0 up to `low`, 1 from `high` on, a cubic between them that ends without slope. A step where they are one.
inline Lanes smoothstep(Lanes low, Lanes high, Lanes x) noexcept {
  const Lanes share = quotient(x - low, high - low);
  const Lanes t = lesser(greater(share, Lanes{}), Lanes{} + 1.0);
  return low == high ? truth(x >= low) : lesser(t * t * (3.0 - 2.0 * t), Lanes{} + 1.0);
}

/// Calls `use` with the operation: a function of three values that ignores those that it hasn't. REQUIRES: an operation
/// on values.
template <typename Use>
void with_operation(Op op, Use&& use) noexcept {
  switch (op) {
    case Op::kX:
    case Op::kY:
    case Op::kZ:
    case Op::kInput: break;
    case Op::kNegate: return use([](Lanes a, Lanes, Lanes) { return -a; });
    case Op::kAbsolute: return use([](Lanes a, Lanes, Lanes) { return absolute(a); });
    case Op::kFloor: return use([](Lanes a, Lanes, Lanes) { return Lanes(_mm256_floor_pd(a)); });
    case Op::kSquare: return use([](Lanes a, Lanes, Lanes) { return a * a; });
    case Op::kSquareRoot: return use([](Lanes a, Lanes, Lanes) { return square_root(greater(a, Lanes{})); });
    case Op::kExponential: return use([](Lanes a, Lanes, Lanes) { return exponential(a); });
    case Op::kLogarithm: return use([](Lanes a, Lanes, Lanes) { return logarithm(a); });
    case Op::kSine: return use([](Lanes a, Lanes, Lanes) { return sine_cosine(a).sine; });
    case Op::kCosine: return use([](Lanes a, Lanes, Lanes) { return sine_cosine(a).cosine; });
    case Op::kTangent: return use([](Lanes a, Lanes, Lanes) { return tangent(a); });
    case Op::kNot: return use([](Lanes a, Lanes, Lanes) { return truth(a == 0.0); });
    case Op::kAdd: return use([](Lanes a, Lanes b, Lanes) { return defined(a + b); });
    case Op::kSubtract: return use([](Lanes a, Lanes b, Lanes) { return defined(a - b); });
    case Op::kMultiply: return use([](Lanes a, Lanes b, Lanes) { return defined(a * b); });
    case Op::kDivide: return use([](Lanes a, Lanes b, Lanes) { return quotient(a, b); });
    case Op::kModulo: return use([](Lanes a, Lanes b, Lanes) { return modulus(a, b); });
    case Op::kPower: return use([](Lanes a, Lanes b, Lanes) { return power(a, b); });
    case Op::kMinimum: return use([](Lanes a, Lanes b, Lanes) { return lesser(a, b); });
    case Op::kMaximum: return use([](Lanes a, Lanes b, Lanes) { return greater(a, b); });
    case Op::kAngle: return use([](Lanes a, Lanes b, Lanes) { return angle_of(a, b); });
    case Op::kLess: return use([](Lanes a, Lanes b, Lanes) { return truth(a < b); });
    case Op::kLessOrEqual: return use([](Lanes a, Lanes b, Lanes) { return truth(a <= b); });
    case Op::kEqual: return use([](Lanes a, Lanes b, Lanes) { return truth(a == b); });
    case Op::kUnequal: return use([](Lanes a, Lanes b, Lanes) { return truth(a != b); });
    case Op::kAnd: return use([](Lanes a, Lanes b, Lanes) { return truth((a != 0.0) & (b != 0.0)); });
    case Op::kOr: return use([](Lanes a, Lanes b, Lanes) { return truth((a != 0.0) | (b != 0.0)); });
    case Op::kIf: return use([](Lanes a, Lanes b, Lanes c) { return a != 0.0 ? b : c; });
    case Op::kClamp: return use([](Lanes a, Lanes b, Lanes c) { return lesser(greater(a, b), c); });
    case Op::kSmoothstep: return use([](Lanes a, Lanes b, Lanes c) { return smoothstep(a, b, c); });
    case Op::kGyroid: return use([](Lanes a, Lanes b, Lanes c) { return gyroid(a, b, c); });
    case Op::kDiamond: return use([](Lanes a, Lanes b, Lanes c) { return diamond(a, b, c); });
    case Op::kSchwarz: return use([](Lanes a, Lanes b, Lanes c) { return schwarz(a, b, c); });
    case Op::kBcc: return use([](Lanes a, Lanes b, Lanes c) { return bcc(a, b, c); });
  }
}

}  // namespace ccslice
