// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/core/formula/random_formula.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

namespace ccslice {

namespace {

using Evaluation = std::function<double(const FormulaPlace&, double)>;
using OfThree = double (*)(double, double, double);

double or_zero(double value) { return std::isnan(value) ? 0 : value; }

double power_of(double a, double b, double) {
  if (a == 0 && b < 0) return 0;
  if (a < 0 && std::floor(b) != b) return 0;
  return or_zero(std::pow(a, b));
}

double remainder_of(double a, double b) {
  if (b == 0 || std::isinf(a) || std::isinf(b) || std::abs(std::floor(a / b)) >= 0x1p53) return 0;
  const double rest = std::fmod(a, b);
  return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}

double step_of(double low, double high, double x) {
  if (low == high) return x >= low ? 1 : 0;
  const double t = std::clamp(or_zero((x - low) / (high - low)), 0.0, 1.0);
  return std::min(t * t * (3 - 2 * t), 1.0);
}

double angle(double x) { return std::abs(x) <= 0x1p40 ? x : 0; }
/// Of turns; exact at their quarters.
double sine_at(double u) {
  const double part = angle(u) - std::round(angle(u));
  constexpr double kQuarters[] = {0, 1, 0, -1};
  const double quarters = 4 * part;
  return std::floor(quarters) == quarters ? kQuarters[(static_cast<int>(quarters) + 4) % 4]
                                          : std::sin(2 * std::numbers::pi * part);
}
double cosine_at(double u) { return sine_at(angle(u) - std::round(angle(u)) + 0.25); }

double gyroid_of(double u, double v, double w) {
  return sine_at(u) * cosine_at(v) + sine_at(v) * cosine_at(w) + sine_at(w) * cosine_at(u);
}
double diamond_of(double u, double v, double w) {
  return sine_at(u) * sine_at(v) * sine_at(w) + sine_at(u) * cosine_at(v) * cosine_at(w) +
         cosine_at(u) * sine_at(v) * cosine_at(w) + cosine_at(u) * cosine_at(v) * sine_at(w);
}
double schwarz_of(double u, double v, double w) { return cosine_at(u) + cosine_at(v) + cosine_at(w); }
double bcc_of(double u, double v, double w) {
  return 2 * (cosine_at(u) * cosine_at(v) + cosine_at(v) * cosine_at(w) + cosine_at(w) * cosine_at(u)) -
         (3 - 2 * (sine_at(u) * sine_at(u) + sine_at(v) * sine_at(v) + sine_at(w) * sine_at(w)));
}

struct Kind {
  const char *before, *between, *after;  // Around its values, and between them.
  std::size_t values;
  bool elementary;
  OfThree value;
};

const Kind kKinds[] = {
    {"(", " + ", ")", 2, false, [](double a, double b, double) { return or_zero(a + b); }},
    {"(", " - ", ")", 2, false, [](double a, double b, double) { return or_zero(a - b); }},
    {"(", " * ", ")", 2, false, [](double a, double b, double) { return or_zero(a * b); }},
    {"(", " / ", ")", 2, false, [](double a, double b, double) { return b == 0 ? 0 : or_zero(a / b); }},
    {"(", " ^ ", ")", 2, true, power_of},
    {"((", "", ")^2)", 1, false, [](double a, double, double) { return a * a; }},
    {"((", "", ")^3)", 1, false, [](double a, double, double) { return or_zero(a * a * a); }},
    {"((", "", ")^4)", 1, false, [](double a, double, double) { return or_zero((a * a) * (a * a)); }},
    {"((", "", ")^-1)", 1, false, [](double a, double, double) { return a == 0 ? 0 : 1 / a; }},
    {"((", "", ")^0.5)", 1, false, [](double a, double, double) { return a < 0 ? 0 : std::sqrt(a); }},
    {"(-", "", ")", 1, false, [](double a, double, double) { return -a; }},
    {"(not ", "", ")", 1, false, [](double a, double, double) { return a == 0 ? 1.0 : 0; }},
    {"(", " < ", ")", 2, false, [](double a, double b, double) { return a < b ? 1.0 : 0; }},
    {"(", " <= ", ")", 2, false, [](double a, double b, double) { return a <= b ? 1.0 : 0; }},
    {"(", " > ", ")", 2, false, [](double a, double b, double) { return a > b ? 1.0 : 0; }},
    {"(", " >= ", ")", 2, false, [](double a, double b, double) { return a >= b ? 1.0 : 0; }},
    {"(", " == ", ")", 2, false, [](double a, double b, double) { return a == b ? 1.0 : 0; }},
    {"(", " != ", ")", 2, false, [](double a, double b, double) { return a != b ? 1.0 : 0; }},
    {"(", " and ", ")", 2, false, [](double a, double b, double) { return a != 0 && b != 0 ? 1.0 : 0; }},
    {"(", " or ", ")", 2, false, [](double a, double b, double) { return a != 0 || b != 0 ? 1.0 : 0; }},
    {"if(", ", ", ")", 3, false, [](double a, double b, double c) { return a != 0 ? b : c; }},
    {"min(", ", ", ")", 2, false, [](double a, double b, double) { return std::min(a, b); }},
    {"max(", ", ", ")", 3, false,
     [](double a, double b, double c) {
       return std::max({a, b, c});
     }},
    {"clamp(", ", ", ")", 3, false, [](double a, double b, double c) { return std::min(std::max(a, b), c); }},
    {"abs(", "", ")", 1, false, [](double a, double, double) { return std::abs(a); }},
    {"floor(", "", ")", 1, false, [](double a, double, double) { return std::floor(a); }},
    {"mod(", ", ", ")", 2, true, [](double a, double b, double) { return remainder_of(a, b); }},
    {"sqrt(", "", ")", 1, false, [](double a, double, double) { return a < 0 ? 0 : std::sqrt(a); }},
    {"exp(", "", ")", 1, true, [](double a, double, double) { return std::exp(a); }},
    {"log(", "", ")", 1, true, [](double a, double, double) { return a <= 0 ? 0 : std::log(a); }},
    {"sin(", "", ")", 1, true, [](double a, double, double) { return std::sin(angle(a)); }},
    {"cos(", "", ")", 1, true, [](double a, double, double) { return std::cos(angle(a)); }},
    {"tan(", "", ")", 1, true, [](double a, double, double) { return std::tan(angle(a)); }},
    {"atan2(", ", ", ")", 2, true,
     [](double a, double b, double) {
       constexpr double kMost = std::numeric_limits<double>::max();
       return std::atan2(std::clamp(a, -kMost, kMost) + 0.0, std::clamp(b, -kMost, kMost) + 0.0);
     }},
    {"smoothstep(", ", ", ")", 3, false, step_of},
    {"gyroid(", ", ", ")", 3, true, gyroid_of},
    {"diamond(", ", ", ")", 3, true, diamond_of},
    {"schwarz(", ", ", ")", 3, true, schwarz_of},
    {"bcc(", ", ", ")", 3, true, bcc_of},
};

RandomFormula leaf(std::mt19937_64& random) {
  switch (random() % 10) {
    case 0: return {"x", [](const FormulaPlace& at, double) { return at.x; }};
    case 1: return {"y", [](const FormulaPlace& at, double) { return at.y; }};
    case 2: return {"z", [](const FormulaPlace& at, double) { return at.z; }};
    case 3: return {"r", [](const FormulaPlace& at, double) { return std::sqrt(at.x * at.x + at.y * at.y); }};
    case 4:
      return {"theta", [](const FormulaPlace& at, double nudge) { return std::atan2(at.y + 0.0, at.x + 0.0) * nudge; }};
    case 5: return {"a", [](const FormulaPlace& at, double) { return at.a; }};
    case 6: return {"b", [](const FormulaPlace& at, double) { return at.b; }};
    default: break;
  }
  constexpr double kNumbers[] = {0, 1, 2, 3, 0.5, 0.1, 10, 1e9, 1e-9, 1e200, 7, 0.25};
  const double number = kNumbers[random() % std::size(kNumbers)];
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", number);
  return {text, [number](const FormulaPlace&, double) { return number; }};
}

}  // namespace

RandomFormula random_formula(std::mt19937_64& random, int depth) {
  if (depth == 0 || random() % 6 == 0) return leaf(random);
  const Kind& kind = kKinds[random() % std::size(kKinds)];
  RandomFormula whole{kind.before, nullptr};
  std::vector<Evaluation> values;
  for (std::size_t i = 0; i < kind.values; ++i) {
    RandomFormula part = random_formula(random, depth - 1);
    whole.text += (i > 0 ? kind.between : "") + part.text;
    values.push_back(std::move(part.value));
  }
  whole.text += kind.after;
  values.resize(3, values.front());
  whole.value = [values, &kind](const FormulaPlace& at, double nudge) {
    const double value = kind.value(values[0](at, nudge), values[1](at, nudge), values[2](at, nudge));
    return kind.elementary ? value * nudge : value;
  };
  return whole;
}

FormulaPlace random_place(std::mt19937_64& random) {
  const auto number = [&] {
    const double uniform = std::uniform_real_distribution<double>(-3, 3)(random);
    switch (random() % 4) {
      case 0: return std::round(uniform);
      case 1: return uniform * 1e6;
      default: return uniform;
    }
  };
  const auto channel = [&] { return static_cast<double>(static_cast<float>(number())); };
  return {number(), number(), number(), channel(), channel()};
}

}  // namespace ccslice
