// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/elementary.h"

#include <cstddef>
#include <limits>

namespace ccslice {

namespace {

/// The bits of four doubles.
using LaneBits = long long __attribute__((vector_size(8 * kLanes)));

/// A comparison of Lanes: all bits of a lane are set where it holds.
using LaneMask = decltype(Lanes{} < Lanes{});

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Added and taken away again, it rounds to integers; before that these are the last bits of the sum.
constexpr double kRounder = 0x1.8p52;

constexpr double kHalfPi[3] = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, -0x1.f1976b7ed8fbcp-110};
/// The first has 42 bits, so that its product with an exponent is exact.
constexpr double kLogTwo[2] = {0x1.62e42fefa38p-1, 0x1.ef35793c7673p-45};

/// Coefficients from the constant one on, in the square of the argument but for kExponential.
constexpr double kSine[] = {-0x1.5555555555549p-3, 0x1.111111110f881p-7,  -0x1.a01a019c126bfp-13,
                            0x1.71de35787367dp-19, -0x1.ae5e66d346acp-26, 0x1.5d932ea4bb6f6p-33};
constexpr double kCosine[] = {0x1.555555555554cp-5,   -0x1.6c16c16c15185p-10, 0x1.a01a019cb27bbp-16,
                              -0x1.27e4f80a7e441p-22, 0x1.1ee9ec4c5795fp-29,  -0x1.8faed14500bd4p-37};
constexpr double kExponential[] = {
    0x1.555555555555bp-3, 0x1.555555555555ap-5,  0x1.111111110ec02p-7,  0x1.6c16c16c14129p-10, 0x1.a01a01b3a1b86p-13,
    0x1.a01a01b209a2p-16, 0x1.71ddefca72456p-19, 0x1.27e4c2ac053bep-22, 0x1.af6c7887ea255p-26, 0x1.1f99d96bf4938p-29};
constexpr double kArea[] = {0x1.999999999999ap-3, 0x1.2492492492493p-3, 0x1.c71c71c71c5cbp-4, 0x1.745d1745e3f2bp-4,
                            0x1.3b13b13150231p-4, 0x1.1111145c6888bp-4, 0x1.e1e06da5ab245p-5, 0x1.af5ddeeb29ac3p-5,
                            0x1.814c485d5dd12p-5, 0x1.a229bad32982cp-5};
constexpr double kArc[] = {-0x1.5555555555554p-2, 0x1.999999999965bp-3, -0x1.2492492475dc2p-3, 0x1.c71c71b77c181p-4,
                           -0x1.745d14c047c2ap-4, 0x1.3b136eb999572p-4, -0x1.110c7a78f953cp-4, 0x1.e1728f8e4b661p-5,
                           -0x1.ab80f7c02744fp-5, 0x1.70fae00c22bc8p-5, -0x1.125661c7cdea1p-5, 0x1.f261933f218b3p-7};

/// A sum that isn't rounded: `low` is less than half a unit in the last place of `high`.
struct Pair {
  Lanes high, low;
};

Lanes all(double value) noexcept { return Lanes{value, value, value, value}; }

LaneBits bits_of(Lanes lanes) noexcept { return reinterpret_cast<LaneBits>(lanes); }
Lanes of_bits(LaneBits bits) noexcept { return reinterpret_cast<Lanes>(bits); }

Lanes fused(Lanes a, Lanes b, Lanes c) noexcept { return multiply_add(a, b, c); }

template <std::size_t kCount>
Lanes polynomial(const double (&coefficients)[kCount], Lanes x) noexcept {
  Lanes value = all(coefficients[kCount - 1]);
  for (std::size_t i = kCount - 1; i-- > 0;) value = fused(value, x, all(coefficients[i]));
  return value;
}

/// a + b. REQUIRES: |a| >= |b|, or a is 0.
Pair exact_sum(Lanes a, Lanes b) noexcept {
  const Lanes sum = a + b;
  return {sum, (a - sum) + b};
}

/// 2^k. REQUIRES: `rounded` is k + kRounder, and k within [-1022, 1023].
Lanes power_of_two(Lanes rounded) noexcept { return of_bits((bits_of(rounded) + 1023) << 52); }

struct SineCosinePair {
  Pair sine, cosine;
};

Pair chosen(LaneMask mask, Pair a, Pair b) noexcept { return {mask ? a.high : b.high, mask ? a.low : b.low}; }

/// Signs flipped where the highest bit is set.
Pair flipped(Pair pair, LaneBits sign) noexcept {
  return {of_bits(bits_of(pair.high) ^ sign), of_bits(bits_of(pair.low) ^ sign)};
}

/// Sine and cosine of the angle `quarters` * pi/2 + rest, where `quarters` is an integer plus kRounder, and the rest
/// within [-pi/4, pi/4] or little more. To some 55 bits.
SineCosinePair in_quadrant(Lanes quarters, Pair rest) noexcept {
  const Lanes square = rest.high * rest.high;
  const Lanes half = 0.5 * square;
  const Lanes sine_tail = fused(rest.high * square, polynomial(kSine, square), rest.low * (1.0 - half));
  const Pair sine = exact_sum(rest.high, sine_tail);
  const Lanes near_one = 1.0 - half;
  const Lanes cosine_tail = fused(square * square, polynomial(kCosine, square), -rest.high * rest.low);
  const Pair cosine = exact_sum(near_one, ((1.0 - near_one) - half) + cosine_tail);
  const LaneBits quadrant = bits_of(quarters);
  const LaneMask odd = (quadrant & 1) != 0;
  const LaneBits sine_sign = (quadrant & 2) << 62, cosine_sign = ((quadrant + 1) & 2) << 62;
  return {flipped(chosen(odd, cosine, sine), sine_sign), flipped(chosen(odd, sine, cosine), cosine_sign)};
}

/// A positive and finite number as m 2^k, with m within [sqrt(1/2), sqrt(2)) or so.
struct Scaled {
  Lanes m, k;
};

Scaled scaled(Lanes x) noexcept {
  constexpr double kLeastNormal = 0x1p-1022;
  const LaneMask subnormal = x < kLeastNormal;
  const LaneBits bits = bits_of(subnormal ? x * 0x1p54 : x);
  constexpr long long kRootOfHalf = 0x3fe6a09e00000000, kBias = 1023;
  // The exponent with a bias, since shifts of negative numbers aren't vector instructions.
  const LaneBits biased = static_cast<LaneBits>((bits - kRootOfHalf + (kBias << 52)) >> 52);
  const Lanes exponent = of_bits(biased | bits_of(all(0x1p52))) - (0x1p52 + static_cast<double>(kBias));
  return {of_bits(bits - ((biased - kBias) << 52)), subnormal ? exponent - 54.0 : exponent};
}

/// The logarithm of a positive and finite number, to some 65 bits.
Pair precise_logarithm(Lanes x) noexcept {
  constexpr double kThird[2] = {0x1.5555555555555p-2, 0x1.5555555555555p-56};
  const auto [m, k] = scaled(x);
  // s = (m - 1) / (m + 1)
  const Lanes numerator = m - 1.0, denominator = m + 1.0, lost = m - (denominator - 1.0);
  const Lanes inverse = 1.0 / denominator;
  const Lanes s = numerator * inverse;
  const Lanes s_low = (fused(-s, denominator, numerator) - s * lost) * inverse;
  const Lanes square = s * s;
  const Lanes square_low = fused(s, s, -square) + 2.0 * s * s_low;
  // atanh(s) / s - 1 = square / 3 + tail
  const Lanes tail = square * square * polynomial(kArea, square);
  const Lanes third = square * kThird[0];
  const Lanes third_low = fused(square, all(kThird[0]), -third) + fused(square, all(kThird[1]), square_low * kThird[0]);
  const Pair more = exact_sum(third, tail);
  const Lanes twice = 2.0 * s, twice_low = 2.0 * s_low;
  const Lanes product = twice * more.high;
  const Lanes product_low =
      fused(twice, more.high, -product) + fused(twice, more.low + third_low, twice_low * more.high);
  const Pair log_of_m = exact_sum(twice, product);
  const Pair sum = exact_sum(k * kLogTwo[0], log_of_m.high);
  return exact_sum(sum.high, sum.low + fused(k, all(kLogTwo[1]), log_of_m.low + (product_low + twice_low)));
}

/// exp(x.high + x.low).
Lanes exponential_of(Pair x) noexcept {
  constexpr double kLogE = 0x1.71547652b82fep+0;  // To base 2.
  constexpr double kFarthest = 800;               // Its exponential is infinite, and that of -800 is 0.
  const LaneMask far = absolute(x.high) > kFarthest;
  const Lanes low = far ? Lanes{} : x.low;
  const Lanes high = lesser(greater(x.high, all(-kFarthest)), all(kFarthest));
  const Lanes k = (high * kLogE + kRounder) - kRounder;
  const Pair rest = exact_sum(fused(-k, all(kLogTwo[0]), high), fused(-k, all(kLogTwo[1]), low));
  const Lanes square = rest.high * rest.high;
  const Lanes tail = fused(square, fused(rest.high, polynomial(kExponential, rest.high), all(0.5)), rest.low);
  // 2^k in two factors: it may be beyond what a double holds where the value isn't.
  const Lanes half = k * 0.5 + kRounder;
  return (1.0 + (rest.high + tail)) * power_of_two(half) * power_of_two(k - (half - kRounder) + kRounder);
}

SineCosinePair precise_sine_cosine(Lanes angle) noexcept {
  constexpr double kQuartersPerRadian = 0x1.45f306dc9c883p-1;
  const Lanes x = absolute(angle) <= kLargestAngle ? angle : Lanes{};
  const Lanes quarters = x * kQuartersPerRadian + kRounder;
  const Lanes k = quarters - kRounder;
  // Exact: multiples of the last place of pi/2 that are less than 1.
  const Lanes first = fused(-k, all(kHalfPi[0]), x);
  const Lanes second = k * kHalfPi[1];
  const Lanes second_low = fused(k, all(kHalfPi[1]), -second);
  const Lanes rest = first - second;
  // The error of that difference, whichever of the two is greater [Knuth, 4.2.2, Theorem B].
  const Lanes taken = first - rest;
  const Lanes lost = (first - (rest + taken)) + (taken - second);
  return in_quadrant(quarters, {rest, lost - fused(k, all(kHalfPi[2]), second_low)});
}

}  // namespace

SineCosine sine_cosine(Lanes angle) noexcept {
  const SineCosinePair both = precise_sine_cosine(angle);
  return {both.sine.high, both.cosine.high};
}

SineCosine sine_cosine_of_turns(Lanes turns) noexcept {
  const Lanes x = absolute(turns) <= kLargestAngle ? turns : Lanes{};
  const Lanes quarters = 4.0 * x + kRounder;
  const Lanes part = 4.0 * x - (quarters - kRounder);
  const Lanes rest = part * kHalfPi[0];
  const SineCosinePair both = in_quadrant(quarters, {rest, fused(part, all(kHalfPi[0]), -rest) + part * kHalfPi[1]});
  return {both.sine.high, both.cosine.high};
}

Lanes tangent(Lanes angle) noexcept {
  const auto [sine, cosine] = precise_sine_cosine(angle);
  const Lanes quotient = sine.high / cosine.high;
  const Lanes left = fused(-quotient, cosine.high, sine.high) + fused(-quotient, cosine.low, sine.low);
  return quotient + left / cosine.high;
}

Lanes exponential(Lanes x) noexcept { return exponential_of({x, Lanes{}}); }

Lanes logarithm(Lanes x) noexcept {
  const LaneMask ordinary = (x > 0.0) & (x < kInfinity);
  const Lanes value = precise_logarithm(ordinary ? x : all(1.0)).high;
  return x == kInfinity ? x : value;
}

Lanes power(Lanes base, Lanes exponent) noexcept {
  const Lanes size = absolute(base);
  const LaneMask ordinary = (size > 0.0) & (size < kInfinity);
  const Pair log_of_base = precise_logarithm(ordinary ? size : all(1.0));
  // Farther exponents give 0, 1 or infinity all the same.
  constexpr double kFarthest = 0x1p100;
  const Lanes times = lesser(greater(exponent, all(-kFarthest)), all(kFarthest));
  const Lanes product = times * log_of_base.high;
  const Lanes product_low = fused(times, log_of_base.high, -product) + times * log_of_base.low;
  Lanes value = exponential_of(exact_sum(product, product_low));
  const LaneMask positive = exponent > 0.0, negative = exponent < 0.0;
  // A negative power of 0 isn't defined, and that of infinity is 0.
  const Lanes beyond = (size > 0.0) & positive ? all(kInfinity) : Lanes{};
  value = ordinary ? value : beyond;
  value = positive | negative ? value : all(1.0);
  const Lanes halved = exponent * 0.5;
  const LaneMask whole = _mm256_floor_pd(exponent) == exponent, even = _mm256_floor_pd(halved) == halved;
  const LaneMask reflected = base < 0.0;
  value = reflected & ~whole ? Lanes{} : value;
  return reflected & whole & ~even ? -value : value;
}

Lanes angle_of(Lanes y, Lanes x) noexcept {
  constexpr double kLargest = std::numeric_limits<double>::max();
  constexpr double kTangent = 0x1.a827999fcef32p-2;  // Of pi/8.
  const Lanes across = lesser(absolute(x), all(kLargest)), along = lesser(absolute(y), all(kLargest));
  const LaneMask steep = along > across;
  const Lanes greatest = steep ? along : across, least = steep ? across : along;
  // Scaled so that numbers are neither too large to be added nor too small to be divided by.
  const Lanes scale = greatest > 0x1p1000 ? all(0x1p-4) : greatest < 0x1p100 ? all(0x1p500) : all(1.0);
  const Lanes a = least * scale, b = greatest * scale;
  const LaneMask turned = a > b * kTangent;
  const Pair top = exact_sum(turned ? -b : Lanes{}, a), bottom = exact_sum(b, turned ? a : Lanes{});
  const Lanes inverse = 1.0 / (bottom.high == 0.0 ? all(1.0) : bottom.high);
  const Lanes t = top.high * inverse;
  const Lanes t_low = (fused(-t, bottom.high, top.high) + (top.low - t * bottom.low)) * inverse;
  const Lanes square = t * t;
  const Lanes tail = fused(t * square, polynomial(kArc, square), t_low);
  // The angle is `quarters` * pi/4 plus or minus atan(t).
  Lanes quarters = turned ? all(1.0) : Lanes{};
  LaneMask minus = steep;
  quarters = steep ? 2.0 - quarters : quarters;
  const LaneMask backward = x < 0.0;
  quarters = backward ? 4.0 - quarters : quarters;
  minus = minus ^ backward;
  const Lanes signed_t = minus ? -t : t, signed_tail = minus ? -tail : tail;
  const Pair sum = exact_sum(quarters * (0.5 * kHalfPi[0]), signed_t);
  const Lanes angle = sum.high + (sum.low + fused(quarters, all(0.5 * kHalfPi[1]), signed_tail));
  return y < 0.0 ? -angle : angle;
}

}  // namespace ccslice
