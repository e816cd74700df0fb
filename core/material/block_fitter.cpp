// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/material/block_fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccslice {
namespace {

// Keeps the fit defined where terms coincide; far below any tolerance.
constexpr double kRidge = 1e-11;
constexpr std::size_t kEvenGroups = kBlockGroups / 2;

}  // namespace

void BlockFitter::factorize(const std::array<BlockValues, 3>& places) noexcept {
  for (std::size_t g = 0; g < kBlockGroups; ++g) {
    terms_[g] = cubic_terms(Lanes{1, 1, 1, 1}, places[0][g], places[1][g], places[2][g]);
  }
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
  row[r] += kRidge * kEvenBlockNodes;
}

/// A = U^T D U, in place: row r of U D right of the diagonal.
void BlockFitter::eliminate() noexcept {
  for (std::size_t j = 0; j < kCubicTerms; ++j) {
    inverse_diagonal_[j] = 1 / rows_[j][j];
    for (std::size_t r = j + 1; r < kCubicTerms; ++r) {
      const double factor = -rows_[j][r] * inverse_diagonal_[j];
      for (std::size_t c = r / kLanes * kLanes; c < kCubicTerms; ++c) rows_[r][c] += factor * rows_[j][c];
    }
  }
}

double BlockFitter::fit(const BlockValues& values, CubicPolynomial& polynomial) noexcept {
  std::array<Lanes, kCubicTerms> sums{};
  for (std::size_t g = 0; g < kEvenGroups; ++g) {
    for (std::size_t t = 0; t < kCubicTerms; ++t) sums[t] = multiply_add(terms_[g][t], values[g], sums[t]);
  }
  for (std::size_t t = 0; t < kCubicTerms; ++t) polynomial[t] = sum(sums[t]);
  solve(polynomial);
  const auto finite = [](double c) { return std::isfinite(c); };
  if (!std::all_of(polynomial.begin(), polynomial.end(), finite)) return std::numeric_limits<double>::infinity();
  Lanes worst{};
  for (std::size_t g = 0; g < kBlockGroups; ++g) {
    Lanes error = values[g], second{};
    for (std::size_t t = 0; t < kCubicTerms; t += 2) {
      error = multiply_add(terms_[g][t], -polynomial[t], error);
      second = multiply_add(terms_[g][t + 1], -polynomial[t + 1], second);
    }
    errors_[g] = error + second;
    const Lanes size = errors_[g] < 0 ? -errors_[g] : errors_[g];
    worst = size > worst ? size : worst;
  }
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

unsigned BlockFitter::axes_to_halve(double share_of_worst) const noexcept {
  std::array<double, 3> range{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t s_stride = kBlockStride[(a + 1) % 3], t_stride = kBlockStride[(a + 2) % 3];
    for (std::size_t t = 0; t < kBlockNodes; ++t) {
      for (std::size_t s = 0; s < kBlockNodes; ++s) {
        range[a] = std::max(range[a], range_of_errors(s * s_stride + t * t_stride, kBlockStride[a]));
      }
    }
  }
  const double most = *std::max_element(range.begin(), range.end());
  unsigned axes = 0;
  for (unsigned a = 0; a < 3; ++a) {
    if (!(range[a] < share_of_worst * most)) axes |= 1u << a;
  }
  return axes;
}

/// How much the errors vary along a line of nodes.
double BlockFitter::range_of_errors(std::size_t first_node, std::size_t stride) const noexcept {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t n = 0; n < kBlockNodes; ++n) {
    const std::size_t slot = block_slot(first_node + n * stride);
    const double error = errors_[slot / kLanes][slot % kLanes];
    low = std::min(low, error);
    high = std::max(high, error);
  }
  return high - low;
}

}  // namespace ccslice
