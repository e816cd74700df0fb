// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/block_bound.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace ccslice {
namespace {

/// Sums of absolute coefficients by degree along one axis: of a coordinate that has so many degrees.
template <std::size_t Size>
using Coordinate = std::array<double, Size>;
/// One number for each degree that products of three coordinates may have.
using Degrees = std::array<double, kBlockDegrees>;

/// |T_k - I T_k| is at most 3.04 for k = 6 and otherwise this, |I T_k| at most 2.125 and 1. Of a
/// product of several that are left out, these counted once for each of its axes are enough, as
///
///   T_a T_b T_c - I (T_a T_b T_c) = (T_a - I T_a) T_b T_c + I T_a (T_b - I T_b) T_c + I T_a I T_b (T_c - I T_c):
///
/// for two T_6 3.04 (1 + 2.125) = 2 * 4.75. Three of them take a little more.
constexpr Degrees kLeftOut = {0, 0, 0, 0, 0, 1.82, 4.75, 1.91, 2, 1.54, 1.82, 1.96, 2};
constexpr double kMoreOfThree = 9;  // 3.04 (1 + 2.125 + 2.125 * 2.125) = 3 * 4.75 + 9.

// Where the polynomial's quadratic and cubic terms stand (CubicPolynomial), with their coordinates.
struct PairTerm {
  std::size_t term, a, b;
};
constexpr std::array<PairTerm, 6> kPairs = {{{3, 1, 1}, {4, 1, 2}, {5, 2, 2}, {11, 0, 1}, {12, 0, 2}, {16, 0, 0}}};
struct TripleTerm {
  std::size_t term, pair, c;  // The product of one of the pairs and a coordinate.
};
constexpr std::array<TripleTerm, 10> kTriples = {{{6, 0, 1},
                                                  {7, 0, 2},
                                                  {8, 1, 2},
                                                  {9, 2, 2},
                                                  {13, 0, 0},
                                                  {14, 1, 0},
                                                  {15, 2, 0},
                                                  {17, 3, 0},
                                                  {18, 4, 0},
                                                  {19, 5, 0}}};

/// cos(n pi / 12).
constexpr std::array<double, 13> kChebyshevNodes = {1,
                                                    0.96592582628906829,
                                                    0.86602540378443865,
                                                    0.70710678118654752,
                                                    0.5,
                                                    0.25881904510252076,
                                                    0,
                                                    -0.25881904510252076,
                                                    -0.5,
                                                    -0.70710678118654752,
                                                    -0.86602540378443865,
                                                    -0.96592582628906829,
                                                    -1};

/// Values at the nodes along an axis -> coefficients.
template <typename Value>
void transform(Value& v0, Value& v1, Value& v2, Value& v3, Value& v4) noexcept {
  const Value outer = v0 + v4, inner = v1 + v3, outer_odd = v4 - v0, inner_odd = v3 - v1, middle = v2;
  v0 = (outer + 2 * inner) * (1.0 / 6);
  v1 = (outer_odd + inner_odd) * (1.0 / 3);
  v2 = (outer - 2 * middle) * (1.0 / 4);
  v3 = (outer_odd - 2 * inner_odd) * (1.0 / 6);
  v4 = (outer - 4 * inner + 6 * middle) * (1.0 / 12);
}

/// The same transform along a row in registers: each value times its column of the matrix.
void transform_row(std::array<Lanes, 2>& row) noexcept {
  constexpr std::array<std::array<Lanes, 2>, kBlockNodes> kColumns = {
      {{{{1.0 / 6, -1.0 / 3, 1.0 / 4, -1.0 / 6}, {1.0 / 12, 0, 0, 0}}},
       {{{1.0 / 3, -1.0 / 3, 0, 1.0 / 3}, {-1.0 / 3, 0, 0, 0}}},
       {{{0, 0, -1.0 / 2, 0}, {1.0 / 2, 0, 0, 0}}},
       {{{1.0 / 3, 1.0 / 3, 0, -1.0 / 3}, {-1.0 / 3, 0, 0, 0}}},
       {{{1.0 / 6, 1.0 / 3, 1.0 / 4, 1.0 / 6}, {1.0 / 12, 0, 0, 0}}}}};
  std::array<Lanes, 2> sums{};
  for (std::size_t n = 0; n < kBlockNodes; ++n) {
    const double value = row[n / kLanes][n % kLanes];
    for (std::size_t half = 0; half < 2; ++half) sums[half] = multiply_add(kColumns[n][half], value, sums[half]);
  }
  row = sums;
}

/// Sums of coefficients by their degree along an axis, for each axis. A coefficient that has a degree along the other
/// axes counts as many times as that degree grows beyond the block. Cubic coordinates have four sums: what they have of
/// degree 4 is rounding.
template <std::size_t Size>
std::array<Coordinate<Size>, 3> sums_by_degree(const BlockGrid& grid, const Degrees& growth) noexcept {
  const Lanes along_row{growth[0], growth[1], growth[2], growth[3]};
  std::array<Coordinate<Size>, 3> sums{};
  Lanes rows{};
  for (std::size_t k = 0; k < Size; ++k) {
    for (std::size_t j = 0; j < Size; ++j) {
      const auto& [first, last] = grid[j + kBlockNodes * k];
      const Lanes size = absolute(first);
      rows = multiply_add(size, growth[j] * growth[k], rows);
      double row = sum(size * along_row);
      if constexpr (Size > kLanes) {
        const double high = std::abs(last[0]);
        sums[0][kLanes] += growth[j] * growth[k] * high;
        row += growth[kLanes] * high;
      }
      sums[1][j] += growth[k] * row;
      sums[2][k] += growth[j] * row;
    }
  }
  for (std::size_t d = 0; d < kLanes; ++d) sums[0][d] = rows[d];
  return sums;
}

/// Sums of absolute coefficients of a product.
template <std::size_t A, std::size_t B>
std::array<double, A + B - 1> product(const std::array<double, A>& a, const std::array<double, B>& b) noexcept {
  std::array<double, A + B - 1> sums{};
  for (std::size_t m = 0; m < A; ++m) {
    for (std::size_t n = 0; n < B; ++n) {
      const double half = 0.5 * a[m] * b[n];
      sums[m + n] += half;
      sums[m > n ? m - n : n - m] += half;
    }
  }
  return sums;
}

/// What stays of sums by degree where interpolation at the nodes leaves something out.
template <std::size_t Size>
double sum_left_out(const std::array<double, Size>& sums, const Degrees& growth) noexcept {
  double left = 0;
  for (std::size_t d = kBlockNodes; d < Size; ++d) left += kLeftOut[d] * growth[d] * sums[d];
  return left;
}

}  // namespace

BlockGrid grid_of(const BlockValues& values) noexcept {
  BlockGrid grid{};
  for (std::size_t n = 0; n < kBlockPoints; ++n) {
    const std::size_t i = n % kBlockNodes;
    grid[n / kBlockNodes][i / kLanes][i % kLanes] = values[block_slot(n) / kLanes][block_slot(n) % kLanes];
  }
  return grid;
}

void to_chebyshev(BlockGrid& grid) noexcept {
  constexpr std::size_t kLayer = kBlockNodes;
  for (std::array<Lanes, 2>& row : grid) transform_row(row);
  for (std::size_t n = 0; n < kBlockNodes; ++n) {
    for (std::size_t half = 0; half < 2; ++half) {
      const auto at = [&](std::size_t j) -> Lanes& { return grid[j + kLayer * n][half]; };
      transform(at(0), at(1), at(2), at(3), at(4));
    }
  }
  for (std::size_t n = 0; n < kBlockNodes; ++n) {
    for (std::size_t half = 0; half < 2; ++half) {
      const auto at = [&](std::size_t k) -> Lanes& { return grid[n + kLayer * k][half]; };
      transform(at(0), at(1), at(2), at(3), at(4));
    }
  }
}

void BlockBound::set_places(const std::array<BlockValues, 3>& places, double beyond, PlaceDegree degree) noexcept {
  places_ = &places;
  degree_ = degree;
  multiplied_ = false;
  x_ = 1 + 2 * beyond;
  growth_ = {1, x_};
  for (std::size_t d = 2; d < growth_.size(); ++d) growth_[d] = 2 * x_ * growth_[d - 1] - growth_[d - 2];
}

template <std::size_t Size>
void BlockBound::multiply_places() noexcept {
  multiplied_ = true;
  std::array<std::array<Coordinate<Size>, 3>, 3> sums;  // By coordinate, then by axis.
  for (std::size_t c = 0; c < 3; ++c) {
    BlockGrid grid = grid_of((*places_)[c]);
    to_chebyshev(grid);
    sums[c] = sums_by_degree<Size>(grid, growth_);
  }
  of_pairs_.fill(0);
  of_triples_.fill(0);
  std::array<double, kPairs.size()> pair_sixes;  // Of T_6, along the axis that has least of it.
  std::array<double, kTriples.size()> triple_sixes;
  pair_sixes.fill(std::numeric_limits<double>::infinity());
  triple_sixes.fill(std::numeric_limits<double>::infinity());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<std::array<double, 2 * Size - 1>, kPairs.size()> pairs;
    // A term is left out if its degree is 5 or more along some axis: what that costs is summed over the axes.
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      pairs[p] = product(sums[kPairs[p].a][axis], sums[kPairs[p].b][axis]);
      of_pairs_[p] += sum_left_out(pairs[p], growth_);
      pair_sixes[p] = std::min(pair_sixes[p], growth_[6] * pairs[p][6]);
    }
    for (std::size_t t = 0; t < kTriples.size(); ++t) {
      const auto triple = product(pairs[kTriples[t].pair], sums[kTriples[t].c][axis]);
      of_triples_[t] += sum_left_out(triple, growth_);
      triple_sixes[t] = std::min(triple_sixes[t], growth_[6] * triple[6]);
    }
  }
  // Terms with T_6 along all three axes are among those with it along any one of them.
  for (std::size_t p = 0; p < kPairs.size(); ++p) of_pairs_[p] += kMoreOfThree * pair_sixes[p];
  for (std::size_t t = 0; t < kTriples.size(); ++t) of_triples_[t] += kMoreOfThree * triple_sixes[t];
}

double BlockBound::operator()(const CubicPolynomial& polynomial, const BlockValues& errors, double enough) noexcept {
  constexpr double kOffGrid = 1.1547005383792517;  // 1 / cos(4 pi / 24).
  BlockGrid coefficients = grid_of(errors);
  to_chebyshev(coefficients);
  const Lanes along_row{growth_[0], growth_[1], growth_[2], growth_[3]};
  double all = 0, of_four = 0;  // Terms, and those of degree 4 in all.
  for (std::size_t k = 0; k < kBlockNodes; ++k) {
    for (std::size_t j = 0; j < kBlockNodes; ++j) {
      const auto& [first, last] = coefficients[j + kBlockNodes * k];
      const Lanes low = absolute(first) * along_row;
      const double high = std::abs(last[0]) * growth_[4], weight = growth_[j] * growth_[k];
      all += weight * (sum(low) + high);
      for (std::size_t i = 0; i < kLanes && i + j + k < kBlockNodes; ++i) of_four += weight * low[i];
      if (j + k == 0) of_four += weight * high;
    }
  }
  double rest = all - of_four;
  // The grid is costly. It is asked only where it may decide: the terms of higher degree have to leave room for it, and
  // at the end half of what the terms of degree 4 come to has to be enough.
  if (!(rest <= enough)) return all;
  if (all > enough) of_four = std::min(of_four, kOffGrid * largest_on_grid(coefficients));
  if (of_four + rest > enough) return of_four + rest;
  rest += left_out(polynomial);
  if (of_four + rest <= enough || of_four + rest - enough > 0.5 * of_four) return of_four + rest;
  return std::min(of_four, kOffGrid * largest_on_grid(coefficients)) + rest;
}

/// Of e only p(X) has terms that interpolation leaves out, and of p only its quadratic and cubic terms. What their
/// products of coordinates leave out doesn't depend on p, so it is found once for all channels of a block.
double BlockBound::left_out(const CubicPolynomial& polynomial) noexcept {
  if (!multiplied_) degree_ == PlaceDegree::kThree ? multiply_places<4>() : multiply_places<5>();
  double left = 0;
  for (std::size_t p = 0; p < kPairs.size(); ++p) left += std::abs(polynomial[kPairs[p].term]) * of_pairs_[p];
  for (std::size_t t = 0; t < kTriples.size(); ++t) left += std::abs(polynomial[kTriples[t].term]) * of_triples_[t];
  return left;
}

/// The largest value of the terms that have degree 4 in all, up to x_.
double BlockBound::largest_on_grid(const BlockGrid& coefficients) const noexcept {
  constexpr std::size_t kGroups = (kGridNodes + kLanes - 1) / kLanes;
  using Row = std::array<Lanes, kGroups>;
  std::array<std::array<double, kGroups * kLanes>, kBlockNodes> t;  // T by degree, then by node.
  for (std::size_t n = 0; n < kGroups * kLanes; ++n) {
    t[0][n] = 1;
    t[1][n] = x_ * kChebyshevNodes[std::min(n, kGridNodes - 1)];
    for (std::size_t d = 2; d < kBlockNodes; ++d) t[d][n] = 2 * t[1][n] * t[d - 1][n] - t[d - 2][n];
  }
  std::array<Row, kBlockNodes> along;
  for (std::size_t d = 0; d < kBlockNodes; ++d) std::memcpy(&along[d], &t[d], sizeof(Row));
  std::array<std::array<Row, kGridNodes>, kBlockNodes> planes{};  // By k, then by node along j.
  for (std::size_t k = 0; k < kBlockNodes; ++k) {
    for (std::size_t j = 0; j + k < kBlockNodes; ++j) {
      Row row{};
      for (std::size_t i = 0; i + j + k < kBlockNodes; ++i) {
        const double c = coefficients[j + kBlockNodes * k][i / kLanes][i % kLanes];
        for (std::size_t g = 0; g < kGroups; ++g) row[g] = multiply_add(along[i][g], c, row[g]);
      }
      for (std::size_t n = 0; n < kGridNodes; ++n) {
        for (std::size_t g = 0; g < kGroups; ++g) planes[k][n][g] = multiply_add(row[g], t[j][n], planes[k][n][g]);
      }
    }
  }
  Lanes most{};
  // Nodes come in pairs, x and -x. There even degrees have the same value and odd ones the opposite, so the larger of
  // the two is |even| + |odd|.
  for (std::size_t last = 0; last <= kGridNodes / 2; ++last) {
    for (std::size_t n = 0; n < kGridNodes; ++n) {
      for (std::size_t g = 0; g < kGroups; ++g) {
        Lanes even = planes[0][n][g], odd{};
        even = multiply_add(planes[2][n][g], t[2][last], multiply_add(planes[4][n][g], t[4][last], even));
        odd = multiply_add(planes[1][n][g], t[1][last], multiply_add(planes[3][n][g], t[3][last], odd));
        const Lanes size = (even < 0 ? -even : even) + (odd < 0 ? -odd : odd);
        most = size > most ? size : most;
      }
    }
  }
  return largest(most);
}

}  // namespace ccslice
