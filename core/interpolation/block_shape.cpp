// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/block_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/interpolation/block_faces.h"
#include "core/interpolation/shares.h"

namespace ccslice {
namespace {

constexpr double kMostSagitta = 0.2;  // Voxels that larger triangles may miss a face by.

/// The largest bulge of arcs along an axis: between every step-th node, as a share of the block's other axes. Of one
/// beyond `enough` only that.
double bulge_along(const BlockPoints& points, const Mat3& inverse_axes, std::size_t axis, std::size_t step,
                   double enough) {
  // Between neighbours there is no node that tells, but a quarter of the bulge over two of them is near enough.
  const std::size_t half = step > 1 ? step / 2 : 1;
  const double of_second_difference = step > 1 ? 0.5 : 0.125;
  const std::size_t s_stride = kBlockStride[(axis + 1) % 3], t_stride = kBlockStride[(axis + 2) % 3],
                    reach = half * kBlockStride[axis];
  double most = 0;
  for (std::size_t t = 0; t < kBlockNodes && most <= enough; t += 2) {
    for (std::size_t s = 0; s < kBlockNodes; s += 2) {
      for (std::size_t n = half; n + half < kBlockNodes; n += step) {
        const std::size_t at = s * s_stride + t * t_stride + n * kBlockStride[axis];
        Vec3 bend = inverse_axes * (points[at - reach] - 2 * points[at] + points[at + reach]);
        bend[static_cast<Eigen::Index>(axis)] = 0;
        most = std::max(most, of_second_difference * bend.cwiseAbs().maxCoeff());
      }
    }
  }
  return most;
}

/// Stops at the first axis beyond `enough`.
Vec3 bulges(const BlockPoints& points, const Mat3& inverse_axes, std::size_t step,
            double enough = std::numeric_limits<double>::infinity()) {
  Vec3 result = Vec3::Zero();
  for (std::size_t a = 0; a < 3 && result.maxCoeff() <= enough; ++a) {
    result[static_cast<Eigen::Index>(a)] = bulge_along(points, inverse_axes, a, step, enough);
  }
  return result;
}

/// How far nodes lie off the straight lines between every step-th node around them: the largest coordinate. Of one
/// beyond `enough` only that.
double sagitta(const BlockPoints& p, std::size_t step, double enough) {
  const std::size_t half = step / 2;
  double most = 0;
  for (std::size_t side = 0; side < 6 && most <= enough; ++side) {
    const BlockFace face(side / 2, side % 2);
    for_each_quad(step, [&](std::size_t s, std::size_t t) {
      const auto off = [&](std::size_t from, std::size_t to, std::size_t node) {
        most = std::max(most, (0.5 * (p[from] + p[to]) - p[node]).cwiseAbs().maxCoeff());
      };
      const std::size_t a = face.node(s, t), b = face.node(s + step, t), c = face.node(s, t + step),
                        d = face.node(s + step, t + step);
      off(a, b, face.node(s + half, t));
      off(a, c, face.node(s, t + half));
      off(c, d, face.node(s + half, t + step));
      off(b, d, face.node(s + step, t + half));
      off(a, d, face.node(s + half, t + half));
      off(b, c, face.node(s + half, t + half));
    });
  }
  return most;
}

/// How far triangles between every step-th node of a face miss it at most:
/// what second differences along either side and the mixed one tell. `heights`: of the face's nodes, across it.
double miss_of_face(const std::array<std::array<double, kBlockNodes>, kBlockNodes>& heights, std::size_t step) {
  const std::size_t half = step > 1 ? step / 2 : 1;
  const double of_second_difference = step > 1 ? 0.5 : 0.125;
  // The node in the middle of a side or, where there is none, the inner one of its ends.
  const auto middle = [&](std::size_t begin) {
    return step > 1 ? begin + half : std::clamp<std::size_t>(begin, 1, kBlockNodes - 2);
  };
  double most = 0;
  for_each_quad(step, [&](std::size_t s, std::size_t t) {
    double along_s = 0, along_t = 0;
    const std::size_t ms = middle(s), mt = middle(t);
    for (std::size_t n = 0; n <= step; ++n) {
      const auto& row = heights[t + n];
      along_s = std::max(along_s, std::abs(row[ms - half] - 2 * row[ms] + row[ms + half]));
      along_t =
          std::max(along_t, std::abs(heights[mt - half][s + n] - 2 * heights[mt][s + n] + heights[mt + half][s + n]));
    }
    const double twist = heights[t][s] + heights[t + step][s + step] - heights[t + step][s] - heights[t][s + step];
    most = std::max(most, of_second_difference * (along_s + along_t) + 0.25 * std::abs(twist));
  });
  return most;
}

/// Sets what the triangles between every step-th node miss.
void set_miss(const BlockPoints& points, BlockShape& shape) {
  shape.miss = shape.bulge.maxCoeff();
  shape.axes_of_miss = 0;
  for (std::size_t side = 0; side < 6; ++side) {
    const BlockFace face(side / 2, side % 2);
    const auto across = shape.inverse_axes.row(static_cast<Eigen::Index>(side / 2));
    std::array<std::array<double, kBlockNodes>, kBlockNodes> heights;
    for (std::size_t t = 0; t < kBlockNodes; ++t) {
      for (std::size_t s = 0; s < kBlockNodes; ++s) heights[t][s] = across.dot(points[face.node(s, t)]);
    }
    const double miss = miss_of_face(heights, shape.step);
    if (miss <= shape.miss) continue;
    shape.miss = miss;
    shape.axes_of_miss = 7u & ~(1u << side / 2);
  }
}

}  // namespace

unsigned BlockShape::bent_axes() const {
  unsigned axes = 0;
  for (int a = 0; a < 3; ++a) {
    if (bulge[a] > kMostBulge) axes |= 1u << a;
  }
  if (miss > kMostMiss) axes |= axes_of_miss;
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
  for (shape.step = kBlockNodes - 1; shape.step > 1; shape.step /= 2) {
    shape.bulge = bulges(points, shape.inverse_axes, shape.step, kMostCoarseBulge);
    if (shape.bulge.maxCoeff() > kMostCoarseBulge) continue;
    if (sagitta(points, shape.step, kMostSagitta) > kMostSagitta) continue;
    set_miss(points, shape);
    return shape;
  }
  shape.bulge = bulges(points, shape.inverse_axes, shape.step);
  set_miss(points, shape);
  return shape;
}

}  // namespace ccslice
