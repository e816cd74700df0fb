// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/cubic_polynomial.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace ccslice {
namespace {

// Keeps the fit defined over places in one row or plane, where terms coincide; far below any tolerance.
constexpr double kRidge = 1e-11;

/// The terms at places first, first + 1, ...; zero beyond the last.
LaneTerms terms_at(std::span<const Vec3> places, std::size_t first) {
  const std::size_t count = std::min(kLanes, places.size() - first);
  Lanes one{}, x{}, y{}, z{};
  for (std::size_t lane = 0; lane < count; ++lane) {
    const Vec3& p = places[first + lane];
    one[lane] = 1;
    x[lane] = p.x();
    y[lane] = p.y();
    z[lane] = p.z();
  }
  return cubic_terms(one, x, y, z);
}

}  // namespace

double value_at(const CubicPolynomial& polynomial, const Vec3& place) noexcept {
  const std::array<double, 4> c = along_row(polynomial, place.y(), place.z());
  return ((c[3] * place.x() + c[2]) * place.x() + c[1]) * place.x() + c[0];
}

Vec3 gradient_at(const CubicPolynomial& polynomial, const Vec3& place) noexcept {
  constexpr double kStep = 1e-3;
  Vec3 result;
  for (int a = 0; a < 3; ++a) {
    const Vec3 step = kStep * Vec3::Unit(a);
    result[a] = (value_at(polynomial, place + step) - value_at(polynomial, place - step)) / (2 * kStep);
  }
  return result;
}

/// The slopes of the polynomial that has all coefficients' sizes, at (most, most, most).
Vec3 bound_of_slopes(const CubicPolynomial& polynomial, double most) noexcept {
  CubicPolynomial c;
  std::transform(polynomial.begin(), polynomial.end(), c.begin(),
                 [](double coefficient) { return std::abs(coefficient); });
  return {c[10] + most * (c[11] + c[12] + 2 * c[16] + most * (c[13] + c[14] + c[15] + 2 * (c[17] + c[18]) + 3 * c[19])),
          c[1] + most * (2 * c[3] + c[4] + c[11] + most * (3 * c[6] + 2 * c[7] + c[8] + 2 * c[13] + c[14] + c[17])),
          c[2] + most * (c[4] + 2 * c[5] + c[12] + most * (c[7] + 2 * c[8] + 3 * c[9] + c[14] + 2 * c[15] + c[18]))};
}

LaneTerms cubic_terms(Lanes one, Lanes x, Lanes y, Lanes z) noexcept {
  LaneTerms out = {one, y, z, y * y, y * z, z * z, y * y * y, y * y * z, y * z * z, z * z * z};
  for (std::size_t k = 0; k < 6; ++k) out[10 + k] = x * out[k];
  for (std::size_t k = 0; k < 3; ++k) out[16 + k] = x * out[10 + k];
  out[19] = x * out[16];
  return out;
}

Lanes values_at(const CubicPolynomial& polynomial, Lanes x, Lanes y, Lanes z) noexcept {
  const LaneTerms terms = cubic_terms(Lanes{1, 1, 1, 1}, x, y, z);
  Lanes result{};
  for (std::size_t t = 0; t < kCubicTerms; ++t) result = multiply_add(terms[t], Lanes{} + polynomial[t], result);
  return result;
}

VoxelFrame VoxelFrame::of(const Vec3& low, const Vec3& high) {
  VoxelFrame frame;
  frame.centre = 0.5 * (low + high);
  for (int a = 0; a < 3; ++a) frame.scale[a] = high[a] > low[a] ? 2 / (high[a] - low[a]) : 1;
  return frame;
}

CubicInLayer in_layer(const CubicPolynomial& c, double z) noexcept {
  return {{((c[9] * z + c[5]) * z + c[2]) * z + c[0], (c[8] * z + c[4]) * z + c[1], c[7] * z + c[3], c[6]},
          {(c[15] * z + c[12]) * z + c[10], c[14] * z + c[11], c[13]},
          {c[18] * z + c[16], c[17]},
          c[19]};
}

/// A cubic's inner Bernstein coefficients are its end values, and a third of the interval on along its end slopes.
double bound_along_row(const std::array<double, 4>& c, double from, double to) noexcept {
  const auto value = [&](double x) { return ((c[3] * x + c[2]) * x + c[1]) * x + c[0]; };
  const auto slope = [&](double x) { return (3 * c[3] * x + 2 * c[2]) * x + c[1]; };
  const double third = (to - from) / 3, first = value(from), last = value(to);
  const double second = first + third * slope(from), before_last = last - third * slope(to);
  if (!std::isfinite(first + second + before_last + last)) return std::numeric_limits<double>::infinity();
  return std::max({first, second, before_last, last});
}

void CubicFitter::factorize(std::span<const Vec3> places) {
  using Square = Eigen::Matrix<double, kCubicTerms, kCubicTerms, Eigen::RowMajor>;
  count_ = places.size();
  terms_.clear();
  for (std::size_t first = 0; first < count_; first += kLanes) terms_.push_back(terms_at(places, first));
  Square normal;
  for (std::size_t r = 0; r < kCubicTerms; ++r) {
    for (std::size_t c = 0; c <= r; ++c) {
      Lanes products{};
      for (const LaneTerms& terms : terms_) products = multiply_add(terms[r], terms[c], products);
      normal(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = sum(products);
    }
  }
  normal.diagonal().array() += kRidge * static_cast<double>(count_);
  // The inverse of the Cholesky factor, rather than the factor: a solution then takes two products, without divisions.
  Square inverse = Square::Identity();
  Eigen::LLT<Square>(normal).matrixL().solveInPlace(inverse);
  std::copy_n(inverse.data(), kCubicTerms * kCubicTerms, inverse_.front().data());
}

double CubicFitter::fit(std::span<const double> values, CubicPolynomial& polynomial) {
  double differences = 0;  // From the first: the mean of equal values is theirs, to the last bit.
  for (const double value : values) differences += value - values.front();
  const double mean = values.front() + differences / static_cast<double>(count_);
  const auto samples_at = [&](std::size_t first) {
    Lanes samples{};
    for (std::size_t i = first; i < std::min(count_, first + kLanes); ++i) samples[i - first] = values[i] - mean;
    return samples;
  };
  LaneTerms products{};
  for (std::size_t first = 0; first < count_; first += kLanes) {
    const Lanes samples = samples_at(first);
    const LaneTerms& terms = terms_[first / kLanes];
    for (std::size_t t = 0; t < kCubicTerms; ++t) products[t] = multiply_add(terms[t], samples, products[t]);
  }
  polynomial = solve(products);
  Lanes worst{};
  for (std::size_t first = 0; first < count_; first += kLanes) {
    const LaneTerms& terms = terms_[first / kLanes];
    Lanes residuals = samples_at(first);
    for (std::size_t t = 0; t < kCubicTerms; ++t) residuals = multiply_add(terms[t], -polynomial[t], residuals);
    const Lanes size = residuals < 0 ? -residuals : residuals;
    worst = worst < size ? size : worst;
  }
  polynomial[0] += mean;
  return largest(worst);
}

/// The coefficients whose normal equations have this right-hand side, summed over the lanes: (L^-1)^T (L^-1 b).
CubicPolynomial CubicFitter::solve(const LaneTerms& products) const {
  Terms half{};
  for (std::size_t r = 0; r < kCubicTerms; ++r) {
    for (std::size_t c = 0; c <= r; ++c) half[r] += inverse_[r][c] * sum(products[c]);
  }
  CubicPolynomial solution{};
  for (std::size_t r = 0; r < kCubicTerms; ++r) {
    for (std::size_t c = 0; c <= r; ++c) solution[c] += inverse_[r][c] * half[r];
  }
  return solution;
}

}  // namespace ccslice
