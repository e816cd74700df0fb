// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/pixel_surface.h"

#include <algorithm>
#include <cmath>

namespace ccslice {
namespace {

using Vec4 = Eigen::Vector4d;

constexpr double kSlopeWeight = 0.5;
constexpr double kStiffness = 1e-4;  // Of second derivatives, against samples of weight 1.

/// Polynomials by power, for the end `s` of [-1,1]; s is -1 or 1.
Vec4 line_to(double s) { return {1, s, 0, 0}; }            // 0 at the other end, 2 at this one.
Vec4 value_at_end(double s) { return {2, 3 * s, 0, -s}; }  // The same with slopes of 0: 4 at this end.
Vec4 value_rest(double s) { return {0, s, 0, -s}; }        // value_at_end() less 2 line_to().
Vec4 slope_at_end(double s) { return {-s, -1, s, 1}; }     // A slope of 4 at this end, 0 else.

Vec4 powers(double t) { return {1, t, t * t, t * t * t}; }
Vec4 slopes_of_powers(double t) { return {0, 1, 2 * t, 3 * t * t}; }

}  // namespace

std::array<double, 4> PixelSurface::row(double v) const {
  const Vec4 c = c_ * powers(v);
  return {c[0], c[1], c[2], c[3]};
}

SurfaceSample PixelSurface::at(const Vec2& place) const {
  const Vec4 u = powers(place.x()), v = powers(place.y());
  return {u.dot(c_ * v), {slopes_of_powers(place.x()).dot(c_ * v), u.dot(c_ * slopes_of_powers(place.y()))}};
}

PixelSurface surface_of_corners(const std::array<SurfaceSample, 4>& corners) {
  Eigen::Matrix4d c = Eigen::Matrix4d::Zero();
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const double s = corner & 1 ? 1 : -1, t = corner >> 1 ? 1 : -1;
    const auto& [value, slope] = corners[corner];
    c += (value * value_at_end(s) + slope.x() * slope_at_end(s)) * line_to(t).transpose() +
         line_to(s) * (value * value_rest(t) + slope.y() * slope_at_end(t)).transpose();
  }
  return PixelSurface(c / 8);
}

QuadraticFitter::QuadraticFitter(std::span<const Vec2> places) : count_(places.size()) {
  std::ranges::copy(places, places_.begin());
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  for (const Vec2& place : places) {
    Basis basis = basis_at(place);
    basis.rightCols<2>() *= kSlopeWeight;
    normal.noalias() += basis * basis.transpose();
  }
  normal.diagonal().tail<3>().array() += kStiffness;
  normal_.compute(normal);
}

const QuadraticFitter& QuadraticFitter::of_corners() {
  static const QuadraticFitter fitter(std::array{Vec2(-1, -1), Vec2(1, -1), Vec2(-1, 1), Vec2(1, 1)});
  return fitter;
}

QuadraticFitter::Basis QuadraticFitter::basis_at(const Vec2& place) {
  const double u = place.x(), v = place.y();
  Basis basis;
  basis.col(0) << 1, u, v, u * u, u * v, v * v;
  basis.col(1) << 0, 1, 0, 2 * u, v, 0;
  basis.col(2) << 0, 0, 1, 0, u, 2 * v;
  return basis;
}

PixelSurface QuadraticFitter::fit(std::span<const SurfaceSample> samples) const {
  Vec6 right = Vec6::Zero();
  for (std::size_t i = 0; i < count_; ++i) {
    const Basis basis = basis_at(places_[i]);
    right += basis.col(0) * samples[i].value + kSlopeWeight * kSlopeWeight * (basis.rightCols<2>() * samples[i].slope);
  }
  const Vec6 a = normal_.solve(right);
  Eigen::Matrix4d c = Eigen::Matrix4d::Zero();
  c(0, 0) = a[0], c(1, 0) = a[1], c(0, 1) = a[2], c(2, 0) = a[3], c(1, 1) = a[4], c(0, 2) = a[5];
  return PixelSurface(c);
}

double QuadraticFitter::misfit(const PixelSurface& surface, std::span<const SurfaceSample> samples) const {
  double worst = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const SurfaceSample fitted = surface.at(places_[i]);
    worst = std::max({worst, std::abs(fitted.value - samples[i].value),
                      kSlopeWeight * (fitted.slope - samples[i].slope).cwiseAbs().maxCoeff()});
  }
  return worst;
}

}  // namespace ccslice
