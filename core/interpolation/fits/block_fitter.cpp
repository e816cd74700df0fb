// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/block_fitter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

namespace ccslice {
namespace {

// Keeps the fit defined where terms coincide; far below any tolerance.
constexpr double kRidgeOfBlock = 1e-11;
constexpr std::size_t kEvenGroups = kBlockGroups / 2;
constexpr double kSurelyFits = 0.5;  // As a share of what is allowed: errors predicted to be below it count as fitting.
constexpr double kAsGoodAsAll = 4;   // Times what halving along all axes leaves: fewer axes do.
constexpr unsigned kFitDegree = 3;

/// A polynomial of degree 4 along an axis: its values at the nodes -> its coefficients of Chebyshev polynomials.
void to_chebyshev(double* first, std::size_t stride) {
  constexpr std::array<std::array<double, kBlockNodes>, kBlockNodes> kTwelveTimes = {
      {{2, 4, 0, 4, 2}, {-4, -4, 0, 4, 4}, {3, 0, -6, 0, 3}, {-2, 4, 0, -4, 2}, {1, -4, 6, -4, 1}}};
  std::array<double, kBlockNodes> values;
  for (std::size_t n = 0; n < kBlockNodes; ++n) values[n] = first[n * stride];
  for (std::size_t d = 0; d < kBlockNodes; ++d) {
    double sum = 0;
    for (std::size_t n = 0; n < kBlockNodes; ++n) sum += kTwelveTimes[d][n] * values[n];
    first[d * stride] = sum / 12;
  }
}

/// What halving along an axis leaves of a term that has this degree there and `others` along the other two: the powers
/// of (1 + x) / 2 or (1 - x) / 2 that a cubic can't take over.
double left_by_halving(unsigned degree, unsigned others) {
  double sum = 0, binomial = 1;
  for (unsigned d = degree;; --d) {
    if (d + others > kFitDegree) sum += binomial;
    if (d == 0) break;
    binomial = binomial * d / (degree - d + 1);
  }
  return std::ldexp(sum, -static_cast<int>(degree));
}

/// What halving leaves of a term's error; by the axes to halve along, then by term.
using LeftOfTerms = std::array<std::array<double, kBlockPoints>, kAllAxes + 1>;

/// A prediction, no bound: halving along several axes is taken to leave the product of what it leaves along each, and
/// T_d to be x^d, with which it has the leading term in common, but for a factor.
LeftOfTerms left_of_terms() {
  LeftOfTerms left{};
  for (std::size_t n = 0; n < kBlockPoints; ++n) {
    std::array<unsigned, 3> degree;
    for (std::size_t a = 0; a < 3; ++a) degree[a] = static_cast<unsigned>(n / kBlockStride[a] % kBlockNodes);
    const unsigned total = degree[0] + degree[1] + degree[2];
    if (total <= kFitDegree) continue;
    for (unsigned axes = 0; axes <= kAllAxes; ++axes) {
      left[axes][n] = 1;
      for (std::size_t a = 0; a < 3; ++a) {
        if (axes >> a & 1) left[axes][n] *= left_by_halving(degree[a], total - degree[a]);
      }
    }
  }
  return left;
}

}  // namespace

void BlockFitter::factorize(const std::array<BlockValues, 3>& places) noexcept {
  for (std::size_t g = 0; g < kBlockGroups; ++g) {
    terms_[g] = cubic_terms(Lanes{1, 1, 1, 1}, places[0][g], places[1][g], places[2][g]);
  }
  // Least squares over even nodes only, slots 0 to 63; the last of these repeats a node, which so counts twice.
  for (std::size_t r = 0; r < kCubicTerms; ++r) fill_normal_row(r);
  eliminate();
}

/// The row's part right of the diagonal, in whole groups. Several sums at a time hide their latency.
void BlockFitter::fill_normal_row(std::size_t r) noexcept {
  std::array<double, kCubicTerms>& row = rows_[r];
  for (std::size_t first = r / kLanes * kLanes; first < kCubicTerms; first += kLanes) {
    std::array<Lanes, kLanes> sums{};
    for (std::size_t g = 0; g < kEvenGroups; ++g) {
      for (std::size_t k = 0; k < kLanes; ++k) sums[k] = multiply_add(terms_[g][r], terms_[g][first + k], sums[k]);
    }
    for (std::size_t k = 0; k < kLanes; ++k) row[first + k] = sum(sums[k]);
  }
  row[r] += kRidgeOfBlock * kEvenBlockNodes;
}

/// A = U^T D U, in place: row r of D U, on the diagonal and right of it. A is symmetric and, with the ridge, positive
/// definite, so no pivots are sought.
void BlockFitter::eliminate() noexcept {
  for (std::size_t j = 0; j < kCubicTerms; ++j) {
    inverse_diagonal_[j] = 1 / rows_[j][j];
    for (std::size_t r = j + 1; r < kCubicTerms; ++r) {
      const double factor = -rows_[j][r] * inverse_diagonal_[j];
      for (std::size_t c = r / kLanes * kLanes; c < kCubicTerms; ++c) rows_[r][c] += factor * rows_[j][c];
    }
  }
}

/// The fit is one of differences from a sample: those of constants are 0, and so is the polynomial then, however little
/// the places determine it and whatever the ridge.
double BlockFitter::fit(const BlockValues& values, CubicPolynomial& polynomial) noexcept {
  const double sample = values[0][0];
  std::array<Lanes, kCubicTerms> sums{};
  for (std::size_t g = 0; g < kEvenGroups; ++g) {
    const Lanes differences = values[g] - sample;
    for (std::size_t t = 0; t < kCubicTerms; ++t) sums[t] = multiply_add(terms_[g][t], differences, sums[t]);
  }
  for (std::size_t t = 0; t < kCubicTerms; ++t) polynomial[t] = sum(sums[t]);
  solve(polynomial);
  const auto finite = [](double c) { return std::isfinite(c); };
  if (!std::all_of(polynomial.begin(), polynomial.end(), finite)) return std::numeric_limits<double>::infinity();
  // Of all nodes: half of these errors are of samples that the fit hasn't seen.
  Lanes worst{};
  for (std::size_t g = 0; g < kBlockGroups; ++g) {
    Lanes error = values[g] - sample, second{};
    for (std::size_t t = 0; t < kCubicTerms; t += 2) {
      error = multiply_add(terms_[g][t], -polynomial[t], error);
      second = multiply_add(terms_[g][t + 1], -polynomial[t + 1], second);
    }
    errors_[g] = error + second;
    const Lanes size = errors_[g] < 0 ? -errors_[g] : errors_[g];
    worst = size > worst ? size : worst;
  }
  polynomial[0] += sample;
  return largest(worst);
}

/// Products of terms and values -> coefficients.
void BlockFitter::solve(CubicPolynomial& x) const noexcept {
  for (std::size_t j = 0; j < kCubicTerms; ++j) {
    const double factor = x[j] * inverse_diagonal_[j];
    for (std::size_t c = j + 1; c < kCubicTerms; ++c) x[c] -= factor * rows_[j][c];
  }
  for (std::size_t j = kCubicTerms; j-- > 0;) {
    double rest = x[j];
    for (std::size_t c = j + 1; c < kCubicTerms; ++c) rest -= rows_[j][c] * x[c];
    x[j] = rest * inverse_diagonal_[j];
  }
}

unsigned BlockFitter::axes_to_halve(double error) const noexcept {
  static const LeftOfTerms kLeft = left_of_terms();
  std::array<double, kBlockPoints> terms;
  for (std::size_t n = 0; n < kBlockPoints; ++n) terms[n] = errors_[block_slot(n) / kLanes][block_slot(n) % kLanes];
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t s_stride = kBlockStride[(a + 1) % 3], t_stride = kBlockStride[(a + 2) % 3];
    for (std::size_t t = 0; t < kBlockNodes; ++t) {
      for (std::size_t s = 0; s < kBlockNodes; ++s) to_chebyshev(&terms[s * s_stride + t * t_stride], kBlockStride[a]);
    }
  }
  std::array<double, kAllAxes + 1> left{};
  for (std::size_t n = 0; n < kBlockPoints; ++n) {
    for (unsigned axes = 0; axes <= kAllAxes; ++axes) left[axes] += kLeft[axes][n] * std::abs(terms[n]);
  }
  if (!(left[0] > 0)) return kAllAxes;
  // Halving along `axes` leaves left[axes] / left[0] of the error, so below `enough` it should fit, or do nearly as
  // well as halving along all.
  const double enough = std::max(kSurelyFits * left[0] / error, kAsGoodAsAll * left[kAllAxes]);
  unsigned best = kAllAxes;
  for (unsigned axes = kAllAxes - 1; axes > 0; --axes) {
    if (!(left[axes] <= enough)) continue;
    const int more = std::popcount(axes) - std::popcount(best);
    if (more < 0 || (more == 0 && left[axes] < left[best])) best = axes;
  }
  return best;
}

}  // namespace ccslice
