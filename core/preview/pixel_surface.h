// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A polynomial over a block of pixels, from values and slopes at a few of them.
//
// Places (u, v) are counted from the block's middle in halves of its side, and slopes go by them, so a block is
// [-1,1]^2. Four samples at its corners give the surface of Adini and Clough, which has all their values and slopes and
// is exact for cubics; neighbours share its sides. Any others give the quadratic that fits them best. How far that is
// from its samples (its MISFIT) says how much of the values isn't quadratic, and so how far either surface may be off
// between the samples.

#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <cstddef>
#include <span>

#include "core/base/types.h"

namespace ccslice {

/// A channel at a place.
struct SurfaceSample {
  double value = 0;
  Vec2 slope = Vec2::Zero();
};

/// Its coefficients: (i, j) of u^i v^j.
class PixelSurface {
 public:
  explicit PixelSurface(const Eigen::Matrix4d& coefficients) : c_(coefficients) {}

  /// The cubic along the row at v: value = c[0] + c[1] u + c[2] u^2 + c[3] u^3.
  std::array<double, 4> row(double v) const;
  SurfaceSample at(const Vec2& place) const;

 private:
  Eigen::Matrix4d c_;
};

/// Samples at (-1,-1), (1,-1), (-1,1), (1,1).
PixelSurface surface_of_corners(const std::array<SurfaceSample, 4>& corners);

/// Fits quadratics to samples at the same places.
class QuadraticFitter {
 public:
  static constexpr std::size_t kMostPlaces = 5;

  /// REQUIRES: 1 to kMostPlaces places, no two alike. What they leave open, such as the bend across a line of them, is
  /// kept small.
  explicit QuadraticFitter(std::span<const Vec2> places);
  /// For surface_of_corners().
  static const QuadraticFitter& of_corners();

  /// REQUIRES: a sample for each place.
  PixelSurface fit(std::span<const SurfaceSample> samples) const;
  /// The largest difference of a value, or of half a slope.
  double misfit(const PixelSurface& surface, std::span<const SurfaceSample> samples) const;

 private:
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  using Basis = Eigen::Matrix<double, 6, 3>;  // Values and both slopes of 1, u, v, u^2, u v, v^2.
  static Basis basis_at(const Vec2& place);

  std::size_t count_;
  std::array<Vec2, kMostPlaces> places_;
  Eigen::LDLT<Eigen::Matrix<double, 6, 6>> normal_;
};

}  // namespace ccslice
