// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/colour_gamut.h"

#include <Eigen/Dense>
#include <bit>
#include <cmath>
#include <limits>

namespace ccslice {
namespace {

constexpr double kFlat = 1e-9;        // Determinants below: colours on a point, a line or a plane.
constexpr double kNegative = -1e-12;  // What rounding leaves of a weight of 0.
// Distance goes before spread. So far apart that rounding of the one doesn't drown the other.
constexpr double kSpreadShare = 1e-6;

}  // namespace

double linear_intensity(double srgb) noexcept {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

Vec3 linear_colour(std::uint32_t rgba) noexcept {
  return {linear_intensity((rgba >> 24) / 255.0), linear_intensity((rgba >> 16 & 255) / 255.0),
          linear_intensity((rgba >> 8 & 255) / 255.0)};
}

ColourGamut::ColourGamut(std::span<const Vec3> colours) : colours_(colours.begin(), colours.end()) {
  for (unsigned subset = 1; subset < 1u << colours.size(); ++subset) {
    std::array<std::uint8_t, 4> members{};
    std::size_t size = 0;
    if (std::popcount(subset) > 4) continue;
    for (std::uint8_t i = 0; i < colours.size(); ++i) {
      if (subset >> i & 1) members[size++] = i;
    }
    add_simplex(members, size);
  }
}

// Orthogonal projection onto the colours' affine hull, in their barycentric coordinates: with S the edges from the
// first colour c, the others' weights w minimize |c + S w - t|^2, so (S^T S) w = S^T (t - c), and the first has what
// they leave of 1.
void ColourGamut::add_simplex(const std::array<std::uint8_t, 4>& members, std::size_t size) {
  const auto edges = static_cast<Eigen::Index>(size) - 1;
  const Vec3& first = colours_[members[0]];
  Eigen::MatrixXd span(3, edges);
  for (Eigen::Index i = 0; i < edges; ++i) span.col(i) = colours_[members[static_cast<std::size_t>(i) + 1]] - first;
  const Eigen::MatrixXd gram = span.transpose() * span;
  if (edges > 0 && gram.determinant() < kFlat) return;
  Simplex simplex{members, size, Eigen::Matrix<double, 4, 3>::Zero(), Eigen::Vector4d::Zero()};
  if (edges > 0) simplex.slope.middleRows(1, edges) = gram.inverse() * span.transpose();
  simplex.slope.row(0) = -simplex.slope.colwise().sum();
  simplex.origin = -simplex.slope * first;
  simplex.origin[0] += 1;
  simplices_.push_back(simplex);
}

/// The point of the hull that is nearest to the colour lies inside some simplex, a triangle, an edge or a single colour
/// included, onto whose affine hull it is the projection. So the nearest projection without negative weights is it.
ColourMix ColourGamut::mix(const Vec3& colour) const {
  ColourMix best;
  double least = std::numeric_limits<double>::infinity();
  for (const Simplex& simplex : simplices_) {
    const Eigen::Vector4d weights = simplex.slope * colour + simplex.origin;
    if (weights.minCoeff() < kNegative) continue;
    Vec3 mixed = Vec3::Zero();
    double spread = 0;
    for (std::size_t i = 0; i < simplex.size; ++i) {
      const double weight = weights[static_cast<Eigen::Index>(i)];
      mixed += weight * colours_[simplex.members[i]];
      spread += weight * (colours_[simplex.members[i]] - colour).squaredNorm();
    }
    const double square = (mixed - colour).squaredNorm();
    if (square + kSpreadShare * spread >= least) continue;
    least = square + kSpreadShare * spread;
    best = {{}, std::sqrt(square)};
    for (std::size_t i = 0; i < simplex.size; ++i) {
      best.weights[simplex.members[i]] = std::max(0.0, weights[static_cast<Eigen::Index>(i)]);
    }
  }
  return best;
}

}  // namespace ccslice
