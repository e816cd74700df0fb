// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A bound on the error of a cubic polynomial over a whole block, not only at its nodes (docs/tolerance.md).
//
// Over a box of parameters u in one regular patch the position X(u) and a channel m(u) are tricubic, so the error
//
//   e(u) = m(u) - p(X(u))
//
// of a cubic p is a polynomial of degree 9 along each axis. Let I be the interpolation at the block's 5 x 5 x 5 nodes.
// I e has degree 4 along each axis; its Chebyshev coefficients c_ijk follow from the errors at the nodes. As no
// Chebyshev polynomial T exceeds 1,
//
//   |I e| <= sum |c_ijk|,    and beyond the box, up to 1 + 2 s along each axis,    sum |c_ijk| T_i T_j T_k (1 + 2 s).
//
// Where that is too much, the part of I e that has degree 4 in all is looked at on a grid of 13 x 13 x 13 Chebyshev
// nodes: it exceeds its largest value there by a factor of 1 / cos(4 pi / 24) = 1.155 at the most. (A polynomial of
// degree n in all is cos(n d) times as large at least at a distance d from where it is largest, where the distance in a
// cube is the largest difference of arc cosines along an axis: Bos, Levenberg, Waldron, Metrics associated to
// multivariate polynomial inequalities, 2004.) The rest of I e counts by its coefficients.
//
// What I leaves out has degree 5 or more along some axis. m has none of that, nor have linear terms of p; in products
// of the coordinates the sums of absolute coefficients multiply (T_m T_n = (T_{m+n} + T_{|m-n|}) / 2), so it is bounded
// by the sums of absolute Chebyshev coefficients of X by degree along each axis. At the nodes T_5, T_7, T_8 and T_9 are
// equal to a T of lower degree, T_6 to T_0 + T_2 - T_4: I takes them for that.
//
// The same holds of X and m of degree 4 along each axis, whose products reach degree 12: T_10, T_11 and T_12 are T_2,
// T_1 and T_0 at the nodes. Beside irregular lines such polynomials are what interpolation makes of X and m
// (interpolation/fits/residual_bound.h).
//
// Nothing here rounds up: the bound holds but for rounding, some 1e-13 of the largest terms.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/interpolation/samples/cell_block.h"
#include "core/interpolation/samples/cubic_polynomial.h"

namespace ccslice {

/// One number at every node of a block, or the coefficient of T_i T_j T_k in its place: rows along the first axis, by
/// the second, then by the third, each of five numbers and three zeros.
using BlockGrid = std::array<std::array<Lanes, 2>, kBlockNodes * kBlockNodes>;

/// Numbers at slots -> at nodes.
BlockGrid grid_of(const BlockValues& values) noexcept;
/// Values at the nodes -> coefficients of Chebyshev polynomials, degree 4 along each axis.
void to_chebyshev(BlockGrid& grid) noexcept;

/// The degree of places and channels along each of a block's axes.
enum class PlaceDegree : std::uint8_t { kThree, kFour };

/// Degrees along an axis, from 0 on, of a product of three coordinates.
inline constexpr std::size_t kBlockDegrees = 3 * (kBlockNodes - 1) + 1;

class BlockBound {
 public:
  /// `places`: of the nodes, in the frame of the polynomials; they stay where they are. `beyond`: how far around the
  /// block bounds are to hold, as a share of its size, as if its patch went on there. REQUIRES: places are polynomials
  /// of that degree.
  void set_places(const std::array<BlockValues, 3>& places, double beyond,
                  PlaceDegree degree = PlaceDegree::kThree) noexcept;

  /// A bound of |e|, if that is at most `enough`; or else some number above `enough`, which is all that is known then.
  /// `errors`: e at the nodes. REQUIRES: set_places() was called; the channel is of the same degree.
  double operator()(const CubicPolynomial& polynomial, const BlockValues& errors, double enough) noexcept;

 private:
  template <std::size_t Size>
  void multiply_places() noexcept;
  double left_out(const CubicPolynomial& polynomial) noexcept;
  double largest_on_grid(const BlockGrid& coefficients) const noexcept;

  static constexpr std::size_t kGridNodes = 13;
  double x_ = 1;                              // 1 + 2 beyond.
  std::array<double, kBlockDegrees> growth_;  // T_0 to T_12 at x_: no T is larger up to there.
  PlaceDegree degree_ = PlaceDegree::kThree;
  const std::array<BlockValues, 3>* places_ = nullptr;
  bool multiplied_ = false;  // What follows is known.
  // By pairs, and by triples, of coordinates: what of their product interpolation at the nodes leaves out.
  std::array<double, 6> of_pairs_;
  std::array<double, 10> of_triples_;
};

}  // namespace ccslice
