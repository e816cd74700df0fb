// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/block_shape.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace ccslice {
namespace {

constexpr double kMostBulge = 0.05;  // Of the thickness: what a cubic fitted to the block may be extended by.

/// The largest bulge of arcs along an axis: between neighbours, as a share of the block's other axes.
double bulge_along(const BlockPoints& points, const Mat3& inverse_axes, std::size_t axis) {
  constexpr double kOfSecondDifference = 1.0 / 8;
  const std::size_t s_stride = kBlockStride[(axis + 1) % 3], t_stride = kBlockStride[(axis + 2) % 3],
                    step = kBlockStride[axis];
  double most = 0;
  for (std::size_t t = 0; t < kBlockNodes; t += 2) {
    for (std::size_t s = 0; s < kBlockNodes; s += 2) {
      for (std::size_t n = 1; n + 1 < kBlockNodes; ++n) {
        const std::size_t at = s * s_stride + t * t_stride + n * step;
        Vec3 bend = inverse_axes * (points[at - step] - 2 * points[at] + points[at + step]);
        bend[static_cast<Eigen::Index>(axis)] = 0;
        most = std::max(most, kOfSecondDifference * bend.cwiseAbs().maxCoeff());
      }
    }
  }
  return most;
}

}  // namespace

unsigned BlockShape::bent_axes() const {
  unsigned axes = 0;
  for (int a = 0; a < 3; ++a) {
    if (bulge[a] > kMostBulge) axes |= 1u << a;
  }
  return axes;
}

double BlockShape::thickness_along_x() const { return 1 / inverse_axes.col(0).cwiseAbs().maxCoeff(); }

BlockShape shape_of(const BlockPoints& points) {
  constexpr std::size_t kHalf = kBlockNodes / 2, kMiddle = std::tuple_size_v<BlockPoints> / 2;
  BlockShape shape;
  for (const Vec3& point : points) shape.box.extend(point);
  Mat3 axes;
  for (std::size_t a = 0; a < 3; ++a) {
    axes.col(static_cast<Eigen::Index>(a)) =
        points[kMiddle + kHalf * kBlockStride[a]] - points[kMiddle - kHalf * kBlockStride[a]];
  }
  shape.voxels = std::abs(axes.determinant());
  shape.inverse_axes = axes.inverse();
  shape.flat = !shape.inverse_axes.allFinite();
  for (std::size_t a = 0; a < 3; ++a) {
    shape.bulge[static_cast<Eigen::Index>(a)] = bulge_along(points, shape.inverse_axes, a);
  }
  return shape;
}

}  // namespace ccslice
