// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/rigid_fit.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace ccslice::cli {
namespace {

Vec3 mean(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

/// sum a_i b_i^T of points about their means.
Mat3 covariance(std::span<const Vec3> a, const Vec3& mean_a, std::span<const Vec3> b, const Vec3& mean_b) {
  Mat3 sum = Mat3::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - mean_a) * (b[i] - mean_b).transpose();
  return sum;
}

/// Linear, and from mean to mean.
Placement about_means(const Mat3& linear, const Vec3& mean_from, const Vec3& mean_to) {
  Placement placement;
  placement.linear() = linear;
  placement.translation() = mean_to - linear * mean_from;
  return placement;
}

/// The largest distance, and where.
std::pair<double, std::size_t> residual(const Placement& placement, std::span<const Vec3> from,
                                        std::span<const Vec3> to) {
  double largest = 0;
  std::size_t farthest = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double squared = (placement * from[i] - to[i]).squaredNorm();
    if (squared <= largest) continue;
    largest = squared;
    farthest = i;
  }
  return {std::sqrt(largest), farthest};
}

}  // namespace

RigidFit fit_rigid(std::span<const Vec3> from, std::span<const Vec3> to) {
  const Vec3 mean_from = mean(from), mean_to = mean(to);
  const Eigen::JacobiSVD<Mat3> svd(covariance(to, mean_to, from, mean_from), Eigen::ComputeFullU | Eigen::ComputeFullV);
  RigidFit fit;
  fit.placement = about_means(svd.matrixU() * svd.matrixV().transpose(), mean_from, mean_to);
  std::tie(fit.residual_mm, fit.farthest) = residual(fit.placement, from, to);
  return fit;
}

ScaleFit fit_scale(std::span<const Vec3> from, std::span<const Vec3> to) {
  const Vec3 mean_from = mean(from), mean_to = mean(to);
  const Mat3 spread = covariance(from, mean_from, from, mean_from);
  const Eigen::FullPivLU<Mat3> inverse(spread);
  ScaleFit fit;
  const Mat3 linear = inverse.isInvertible() ? Mat3(covariance(to, mean_to, from, mean_from) * inverse.inverse())
                                             : Mat3(Mat3::Identity());
  fit.factors = Eigen::JacobiSVD<Mat3>(linear).singularValues();
  fit.residual_mm = residual(about_means(linear, mean_from, mean_to), from, to).first;
  return fit;
}

Placement snapped_to_axes(const Placement& placement, std::span<const Vec3> from) {
  constexpr double kNear = 1e-6;
  Mat3 snapped;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double entry = placement.linear()(row, column), whole = std::round(entry);
      if (std::abs(entry - whole) > kNear) return placement;
      snapped(row, column) = whole + 0.0;
    }
  }
  const Vec3 middle = mean(from);
  return about_means(snapped, middle, placement * middle);
}

}  // namespace ccslice::cli
