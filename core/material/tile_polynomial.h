// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cubic polynomials that stand for material channels within a tile of voxels.
//
// A channel is a smooth function of the world point inside a tile, so a polynomial of total degree 3 (20 coefficients)
// is fitted by least squares to exact samples at voxel centres, and judged by its LEAVE-ONE-OUT errors: the error at
// sample i of the fit to all others, r_i / (1 - h_ii), where r_i is the residual and h_ii the leverage. Every sample so
// serves as a check point of a fit that hasn't seen it, at the cost of one fit.
//
// Coordinates are voxel indices, shifted and scaled to [-1, 1]^3 over the fitted voxels (TileFrame).

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/lanes.h"
#include "core/base/types.h"

namespace ccslice {

inline constexpr std::size_t kCubicTerms = 20;

/// Voxel (column, row, layer) -> [-1, 1]^3: (voxel - centre) * scale.
struct TileFrame {
  Vec3 centre = Vec3::Zero();
  Vec3 scale = Vec3::Ones();

  /// Of voxels [low, high], both included.
  static TileFrame of(const Vec3& low, const Vec3& high);
  Vec3 operator()(const Vec3& voxel) const { return (voxel - centre).cwiseProduct(scale); }
};

/// Coefficients of x^i y^j z^k, i + j + k <= 3, ordered by i: ten of x^0, six of x^1, three of x^2, one of x^3.
using CubicPolynomial = std::array<double, kCubicTerms>;

/// The polynomial in a layer: coefficients of y^j times 1, x, x^2, x^3.
struct CubicInLayer {
  std::array<double, 4> of_one;
  std::array<double, 3> of_x;
  std::array<double, 2> of_x_squared;
  double of_x_cubed;
};
CubicInLayer in_layer(const CubicPolynomial& polynomial, double z) noexcept;

/// The polynomial along a row: coefficients of 1, x, x^2, x^3.
inline std::array<double, 4> along_row(const CubicInLayer& layer, double y) noexcept {
  const auto& [a, b, c, d] = layer;
  return {((a[3] * y + a[2]) * y + a[1]) * y + a[0], (b[2] * y + b[1]) * y + b[0], c[1] * y + c[0], d};
}
inline std::array<double, 4> along_row(const CubicPolynomial& polynomial, double y, double z) noexcept {
  return along_row(in_layer(polynomial, z), y);
}

/// Nothing between two places along a row is larger, but for rounding: the largest coefficient in Bernstein form.
/// Infinite if one of them isn't finite.
double bound_along_row(const std::array<double, 4>& row, double from, double to) noexcept;

double value_at(const CubicPolynomial& polynomial, const Vec3& place) noexcept;
/// By central differences: exact to about a millionth of the third derivatives.
Vec3 gradient_at(const CubicPolynomial& polynomial, const Vec3& place) noexcept;

/// The terms at four places, each times `one`.
using LaneTerms = std::array<Lanes, kCubicTerms>;
LaneTerms cubic_terms(Lanes one, Lanes x, Lanes y, Lanes z) noexcept;

Lanes values_at(const CubicPolynomial& polynomial, Lanes x, Lanes y, Lanes z) noexcept;

/// Fits many channels over the same places. Memory is kept from fit to fit.
class CubicFitter {
 public:
  /// REQUIRES: at least kCubicTerms places, in [-1, 1]^3.
  void factorize(std::span<const Vec3> places);
  /// How much the fit's value at each place depends on errors of the samples: the variance there for samples of
  /// variance 1. At most about 1 among the samples; large where a fit extrapolates, or where the samples leave it
  /// undetermined. Returns the largest.
  double largest_leverage(std::span<const Vec3> places) const;
  /// Fits values[i * stride] at the i-th place; returns the largest leave-one-out error.
  double fit(const double* values, std::size_t stride, CubicPolynomial& polynomial);

 private:
  using Terms = std::array<double, kCubicTerms>;

  Lanes leverages(const LaneTerms& terms) const;
  CubicPolynomial solve(const LaneTerms& products) const;

  std::size_t count_ = 0;
  std::vector<LaneTerms> terms_;  // Of the places, by fours; zero beyond the last.
  // L^-1, lower triangular, where L L^T = terms^T terms.
  std::array<Terms, kCubicTerms> inverse_;
  std::vector<double> one_minus_;  // 1 - leverage.
};

}  // namespace ccslice
