// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/material/tile_polynomial.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace ccslice {
namespace {

// Keeps the fit defined over places in one row or plane, where terms coincide; far below any tolerance.
constexpr double kRidge = 1e-11;
// A sample that determines part of the fit nearly alone can't be checked by the others: its error counts as infinite.
constexpr double kLargestLeverage = 0.98;

void write_terms(const Vec3& p, double* out) {
  const double x = p.x(), y = p.y(), z = p.z();
  const std::array<double, 10> plane = {1, y, z, y * y, y * z, z * z, y * y * y, y * y * z, y * z * z, z * z * z};
  std::copy(plane.begin(), plane.end(), out);
  for (std::size_t k = 0; k < 6; ++k) out[10 + k] = x * plane[k];
  for (std::size_t k = 0; k < 3; ++k) out[16 + k] = x * x * plane[k];
  out[19] = x * x * x;
}

}  // namespace

TileFrame TileFrame::of(const Vec3& low, const Vec3& high) {
  TileFrame frame;
  frame.centre = 0.5 * (low + high);
  for (int a = 0; a < 3; ++a) frame.scale[a] = high[a] > low[a] ? 2 / (high[a] - low[a]) : 1;
  return frame;
}

std::array<double, 4> along_row(const CubicPolynomial& c, double y, double z) noexcept {
  const double yy = y * y, yz = y * z, zz = z * z;
  return {c[0] + c[1] * y + c[2] * z + c[3] * yy + c[4] * yz + c[5] * zz + (c[6] * yy + c[7] * yz + c[8] * zz) * y +
              c[9] * zz * z,
          c[10] + c[11] * y + c[12] * z + c[13] * yy + c[14] * yz + c[15] * zz, c[16] + c[17] * y + c[18] * z, c[19]};
}

void CubicFitter::factorize(std::span<const Vec3> places) {
  const auto count = static_cast<Eigen::Index>(places.size());
  terms_.resize(count, Eigen::NoChange);
  for (Eigen::Index i = 0; i < count; ++i) write_terms(places[static_cast<std::size_t>(i)], terms_.row(i).data());
  Square normal = terms_.transpose().lazyProduct(terms_);
  normal.diagonal().array() += kRidge * static_cast<double>(count);
  lower_ = Eigen::LLT<Square>(normal).matrixL();
  one_minus_.resize(places.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Terms half = lower_.triangularView<Eigen::Lower>().solve(terms_.row(i).transpose());
    const double leverage = half.squaredNorm();
    one_minus_[static_cast<std::size_t>(i)] = leverage <= kLargestLeverage ? 1 - leverage : 0;
  }
}

double CubicFitter::leverage(const Vec3& place) const {
  Terms terms;
  write_terms(place, terms.data());
  return lower_.triangularView<Eigen::Lower>().solve(terms).squaredNorm();
}

double CubicFitter::fit(const double* values, std::size_t stride, CubicPolynomial& polynomial) {
  Terms solution = Terms::Zero();
  const Eigen::Index count = terms_.rows();
  for (Eigen::Index i = 0; i < count; ++i) {
    solution += values[static_cast<std::size_t>(i) * stride] * terms_.row(i).transpose();
  }
  lower_.triangularView<Eigen::Lower>().solveInPlace(solution);
  lower_.triangularView<Eigen::Lower>().transpose().solveInPlace(solution);
  Eigen::Map<Terms>(polynomial.data()) = solution;
  double worst = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double residual = values[k * stride] - terms_.row(i).dot(solution);
    if (!(one_minus_[k] > 0)) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, std::abs(residual) / one_minus_[k]);
  }
  return worst;
}

}  // namespace ccslice
