// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/interval_operations.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>

#include "core/formula/run_program.h"

namespace ccslice {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr Interval kEverything{-kInfinite, kInfinite};
constexpr Interval kTruthValue{0, 1};

Interval exactly(double value) { return {value, value}; }

Interval hull(std::initializer_list<double> values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}
Interval hull(const Interval& a, const Interval& b) { return {std::min(a.low, b.low), std::max(a.high, b.high)}; }
Interval common(const Interval& a, const Interval& b) { return {std::max(a.low, b.low), std::min(a.high, b.high)}; }

/// By more than elementary functions err.
Interval widened(const Interval& a) {
  constexpr double kShare = 0x1p-50, kLeast = 0x1p-1070;
  const auto reach = [](double value) { return std::isfinite(value) ? std::abs(value) * kShare + kLeast : 0; };
  return {a.low - reach(a.low), a.high + reach(a.high)};
}

Interval monotone(Op op, const Interval& a) {
  return widened({folded(op, a.low, a.low, a.low), folded(op, a.high, a.high, a.high)});
}

/// Where infinities of both signs meet, anything may come of it.
Interval sum(const Interval& a, const Interval& b) {
  const Interval result{a.low + b.low, a.high + b.high};
  return std::isnan(result.low) || std::isnan(result.high) ? kEverything : result;
}

Interval negative(const Interval& a) { return {-a.high, -a.low}; }

Interval product(const Interval& a, const Interval& b) {
  const auto times = [](double x, double y) { return folded(Op::kMultiply, x, y, 0); };
  return hull({times(a.low, b.low), times(a.low, b.high), times(a.high, b.low), times(a.high, b.high)});
}

Interval size(const Interval& a) {
  if (a.low >= 0) return a;
  if (a.high <= 0) return negative(a);
  return {0, std::max(-a.low, a.high)};
}

Interval square(const Interval& a) {
  const Interval root = size(a);
  return {root.low * root.low, root.high * root.high};
}

/// Divided by numbers above 0 and up to `greatest`.
Interval divided_by_up_to(const Interval& a, double greatest) {
  const auto at_most = [&](double x) { return folded(Op::kDivide, x, greatest, 0); };
  Interval result = hull({0, at_most(a.low), at_most(a.high)});
  if (a.low < 0) result.low = -kInfinite;
  if (a.high > 0) result.high = kInfinite;
  return result;
}

Interval divided(const Interval& a, const Interval& b) {
  const auto over = [](double x, double y) { return folded(Op::kDivide, x, y, 0); };
  if (!b.contains(0)) return hull({over(a.low, b.low), over(a.low, b.high), over(a.high, b.low), over(a.high, b.high)});
  Interval result = exactly(0);
  if (b.high > 0) result = hull(result, divided_by_up_to(a, b.high));
  if (b.low < 0) result = hull(result, divided_by_up_to(negative(a), -b.low));
  return result;
}

/// REQUIRES: base.low >= 0.
Interval power_of_size(const Interval& base, const Interval& exponent) {
  const auto to = [](double x, double y) { return folded(Op::kPower, x, y, 0); };
  Interval result = hull({to(base.low, exponent.low), to(base.low, exponent.high), to(base.high, exponent.low),
                          to(base.high, exponent.high)});
  if (base.low == 0 && exponent.low < 0 && base.high > 0) result.high = kInfinite;
  if (base.low == 0) result.low = 0;
  if (exponent.contains(0)) result = hull(result, exactly(1));
  return widened(result);
}

Interval powers(const Interval& base, const Interval& exponent) {
  if (base.low >= 0) return common(power_of_size(base, exponent), {0, kInfinite});
  const Interval of_size = power_of_size(size(base), exponent);
  const bool even = exponent.low == exponent.high && std::floor(exponent.low / 2) == exponent.low / 2;
  if (even) return common(hull(exactly(0), of_size), {0, kInfinite});
  return hull(exactly(0), hull(negative(of_size), of_size));
}

/// Whether one of the angles first + k step lies in `a` or near it.
bool meets(const Interval& a, double first, double step) {
  constexpr double kNear = 1e-6;
  return std::floor((a.high + kNear - first) / step) * step + first >= a.low - kNear;
}

/// Whether sines and such of `a` go through no more than one period, at angles that double numbers tell apart.
bool is_narrow(const Interval& a) { return a.low > -1e6 && a.high < 1e6 && a.high - a.low < 2 * std::numbers::pi; }

/// Of a sine or cosine that is greatest at `crest`.
Interval wave(Op op, const Interval& a, double crest) {
  constexpr double kPi = std::numbers::pi;
  if (!is_narrow(a)) return {-1, 1};
  Interval result = widened(hull({folded(op, a.low, 0, 0), folded(op, a.high, 0, 0)}));
  if (meets(a, crest, 2 * kPi)) result.high = 1;
  if (meets(a, crest + kPi, 2 * kPi)) result.low = -1;
  return common(result, {-1, 1});
}

Interval tangents(const Interval& a) {
  if (!is_narrow(a) || meets(a, std::numbers::pi / 2, std::numbers::pi)) return kEverything;
  return monotone(Op::kTangent, a);
}

Interval logarithms(const Interval& a) {
  if (a.high <= 0) return exactly(0);
  if (a.low > 0) return monotone(Op::kLogarithm, a);
  constexpr double kOfLeast = -745;  // Of the least double above 0.
  return {kOfLeast, std::max(0.0, widened(exactly(folded(Op::kLogarithm, a.high, 0, 0))).high)};
}

Interval angles(const Interval& y, const Interval& x) {
  const Interval whole = widened({y.low < 0 ? -std::numbers::pi : 0, std::numbers::pi});
  if (x.low < 0 && y.contains(0)) return whole;
  const auto angle = [](double b, double a) { return folded(Op::kAngle, b, a, 0); };
  const Interval corners =
      hull({angle(y.low, x.low), angle(y.low, x.high), angle(y.high, x.low), angle(y.high, x.high)});
  return widened(x.contains(0) && y.contains(0) ? hull(exactly(0), corners) : corners);
}

Interval truth_of(bool always, bool never) {
  if (always) return exactly(1);
  return never ? exactly(0) : kTruthValue;
}

bool is_true(const Interval& a) { return !a.contains(0); }
bool is_false(const Interval& a) { return a.low == 0 && a.high == 0; }

Interval lesser_of(const Interval& a, const Interval& b) { return {std::min(a.low, b.low), std::min(a.high, b.high)}; }
Interval greater_of(const Interval& a, const Interval& b) { return {std::max(a.low, b.low), std::max(a.high, b.high)}; }

Interval equality(const Interval& a, const Interval& b, bool when_equal) {
  const bool equal = a.low == a.high && b.low == b.high && a.low == b.low;
  const bool apart = a.high < b.low || b.high < a.low;
  return when_equal ? truth_of(equal, apart) : truth_of(apart, equal);
}

Interval steps(const Interval& low, const Interval& high, const Interval& x) {
  if (low.high >= high.low && high.high >= low.low) return kTruthValue;  // They may be one.
  const Interval share = divided(sum(x, negative(low)), sum(high, negative(low)));
  const auto at = [](double t) { return folded(Op::kSmoothstep, 0, 1, t); };
  return common(widened({at(share.low), at(share.high)}), kTruthValue);
}

Interval lattice(double low, double high) {
  constexpr double kRounding = 0x1p-48;
  return {low - kRounding, high + kRounding};
}

Interval of_one(Op op, const Interval& a) {
  switch (op) {
    case Op::kNegate: return negative(a);
    case Op::kAbsolute: return size(a);
    case Op::kFloor: return {std::floor(a.low), std::floor(a.high)};
    case Op::kSquare: return square(a);
    case Op::kSquareRoot: return {std::sqrt(std::max(a.low, 0.0)), std::sqrt(std::max(a.high, 0.0))};
    case Op::kExponential: return common(monotone(op, a), {0, kInfinite});
    case Op::kLogarithm: return logarithms(a);
    case Op::kSine: return wave(op, a, std::numbers::pi / 2);
    case Op::kCosine: return wave(op, a, 0);
    case Op::kTangent: return tangents(a);
    case Op::kNot: return truth_of(is_false(a), is_true(a));
    default: return kEverything;
  }
}

Interval of_two(Op op, const Interval& a, const Interval& b) {
  switch (op) {
    case Op::kAdd: return sum(a, b);
    case Op::kSubtract: return sum(a, negative(b));
    case Op::kMultiply: return product(a, b);
    case Op::kDivide: return divided(a, b);
    case Op::kModulo: return hull(exactly(0), b);
    case Op::kPower: return powers(a, b);
    case Op::kMinimum: return lesser_of(a, b);
    case Op::kMaximum: return greater_of(a, b);
    case Op::kAngle: return angles(a, b);
    case Op::kLess: return truth_of(a.high < b.low, a.low >= b.high);
    case Op::kLessOrEqual: return truth_of(a.high <= b.low, a.low > b.high);
    case Op::kEqual: return equality(a, b, true);
    case Op::kUnequal: return equality(a, b, false);
    case Op::kAnd: return truth_of(is_true(a) && is_true(b), is_false(a) || is_false(b));
    case Op::kOr: return truth_of(is_true(a) || is_true(b), is_false(a) && is_false(b));
    default: return kEverything;
  }
}

}  // namespace

Interval on_intervals(Op op, const Interval& a, const Interval& b, const Interval& c) noexcept {
  switch (op) {
    case Op::kIf: return is_true(a) ? b : is_false(a) ? c : hull(b, c);
    case Op::kClamp: return lesser_of(greater_of(a, b), c);
    case Op::kSmoothstep: return steps(a, b, c);
    case Op::kGyroid: return lattice(-1.5, 1.5);
    case Op::kDiamond: return lattice(-std::numbers::sqrt2, std::numbers::sqrt2);
    case Op::kSchwarz: return lattice(-3, 3);
    case Op::kBcc: return lattice(-5, 3);
    default: return op <= Op::kNot ? of_one(op, a) : of_two(op, a, b);
  }
}

}  // namespace ccslice
