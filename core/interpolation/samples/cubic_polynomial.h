// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cubic polynomials of total degree 3 (20 coefficients) that stand for material channels in a box of voxels, and their
// fit by least squares.
//
// Coordinates are voxel indices, shifted and scaled to [-1, 1]^3 over what is fitted (VoxelFrame).

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
struct VoxelFrame {
  Vec3 centre = Vec3::Zero();
  Vec3 scale = Vec3::Ones();

  /// The frame of voxels [low, high], both included.
  static VoxelFrame of(const Vec3& low, const Vec3& high);
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
/// The gradient by central differences: exact to about a millionth of the third derivatives.
Vec3 gradient_at(const CubicPolynomial& polynomial, const Vec3& place) noexcept;

/// Along each axis no slope is larger, up or down, where all coordinates are within [-most, most].
Vec3 bound_of_slopes(const CubicPolynomial& polynomial, double most) noexcept;

/// The terms at four places, each times `one`.
using LaneTerms = std::array<Lanes, kCubicTerms>;
LaneTerms cubic_terms(Lanes one, Lanes x, Lanes y, Lanes z) noexcept;

Lanes values_at(const CubicPolynomial& polynomial, Lanes x, Lanes y, Lanes z) noexcept;

/// Fits many channels over the same places. Memory is kept from fit to fit.
class CubicFitter {
 public:
  /// REQUIRES: some places, in [-1, 1]^3. Where they don't determine a polynomial, the one with small coefficients
  /// about the mean is taken.
  void factorize(std::span<const Vec3> places);
  /// Fits a value at each place; returns the largest error there.
  double fit(std::span<const double> values, CubicPolynomial& polynomial);

 private:
  using Terms = std::array<double, kCubicTerms>;

  CubicPolynomial solve(const LaneTerms& products) const;

  std::size_t count_ = 0;
  std::vector<LaneTerms> terms_;  // Terms at the places, by fours; zero beyond the last.
  // L^-1, lower triangular, where L L^T = terms^T terms.
  std::array<Terms, kCubicTerms> inverse_;
};

}  // namespace ccslice
