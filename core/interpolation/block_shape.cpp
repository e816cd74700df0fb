// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/block_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/base/lanes.h"
#include "core/interpolation/block_arcs.h"
#include "core/interpolation/block_faces.h"
#include "core/interpolation/shares.h"

namespace ccslice {
namespace {

constexpr double kNotable = 0.25;     // Of what a face is missed by: an axis that has more is halved for it.
constexpr double kMostSagitta = 0.2;  // Voxels that larger triangles may miss a face by.

double size_of(const Vec3& vector) { return vector.cwiseAbs().maxCoeff(); }

/// The largest coordinates of what tells how far chords are off some arcs (ArcBends), each of whichever arc has it: of
/// arcs that aren't cubics all differences at hand count.
class LargestBends {
 public:
  /// A lane a coordinate.
  void add(const ArcBends<Lanes>& bends) {
    const auto& [first, second, third] = bends.at;
    of_four_ = greater(of_four_, absolute(bends.middle(0, 4)));
    of_two_ = greater(of_two_, greater(absolute(bends.middle(0, 2)), absolute(bends.middle(2, 2))));
    of_one_ = greater(of_one_, greater(absolute(bends.middle(0, 1)), absolute(bends.middle(3, 1))));
    of_one_ = greater(of_one_, greater(greater(absolute(first), absolute(third)), absolute(second)) / 8);
    cubic_ = greater(cubic_, greater(absolute(second - first), absolute(third - second)));
  }
  /// How far chords between every step-th node are off: the largest coordinate.
  double off(std::size_t step) const {
    const Lanes middle = step == 4 ? of_four_ : step == 2 ? of_two_ : of_one_;
    return highest_over_arc(largest(middle), of_third_differences(step) * largest(cubic_)).height;
  }

 private:
  Lanes of_four_{}, of_two_{}, of_one_{}, cubic_{};
};

/// Arcs along each axis, through every other node of the others.
class BlockArcs {
 public:
  BlockArcs(const BlockPoints& points, const Mat3& inverse_axes) {
    std::array<Lanes, 3> columns;
    for (Eigen::Index a = 0; a < 3; ++a) columns[static_cast<std::size_t>(a)] = lanes_of(inverse_axes.col(a));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t s_stride = kBlockStride[(axis + 1) % 3], t_stride = kBlockStride[(axis + 2) % 3];
      Lanes others{1, 1, 1, 0};
      others[axis] = 0;
      for (std::size_t line = 0; line < kLines; ++line) {
        const Vec3* const first = &points[2 * (line % 3 * s_stride + line / 3 * t_stride)];
        ArcBends<Lanes> bends = bends_of<Lanes>([&](std::size_t n) { return lanes_of(first[n * kBlockStride[axis]]); });
        if (line % 2 == 0 && line != kLines / 2) at_corners_.add(bends);
        if (line != kLines / 2) on_faces_.add(bends);
        for (Lanes& bend : bends.at) {
          bend = others * (columns[0] * bend[0] + columns[1] * bend[1] + columns[2] * bend[2]);
        }
        in_shares_[axis].add(bends);
      }
    }
  }

  /// The largest bulge between every step-th node, as a share of the block's other axes, by axis.
  Vec3 bulges(std::size_t step) const {
    return {in_shares_[0].off(step), in_shares_[1].off(step), in_shares_[2].off(step)};
  }

  /// How far chords between every step-th node of the faces are off, voxels. REQUIRES: step > 1.
  double off_faces(std::size_t step) const { return (step > 2 ? at_corners_ : on_faces_).off(step); }

 private:
  static constexpr std::size_t kLines = 9;

  static Lanes lanes_of(const Vec3& vector) { return Lanes{vector.x(), vector.y(), vector.z(), 0}; }

  std::array<LargestBends, 3> in_shares_;  // By axis.
  LargestBends at_corners_, on_faces_;     // In voxels.
};

/// How far nodes lie off the straight lines between every step-th node around them: the largest coordinate. Of one
/// beyond `enough` only that.
double sagitta(const BlockPoints& p, const BlockArcs& arcs, std::size_t step, double enough) {
  const std::size_t half = step / 2;
  double most = arcs.off_faces(step);
  for (std::size_t side = 0; side < 6 && most <= enough; ++side) {
    const BlockFace face(side / 2, side % 2);
    for_each_quad(step, [&](std::size_t s, std::size_t t) {
      const Vec3& middle = p[face.node(s + half, t + half)];
      const auto off = [&](const Vec3& from, const Vec3& to) {
        most = std::max(most, size_of(0.5 * (from + to) - middle));
      };
      off(p[face.node(s, t)], p[face.node(s + step, t + step)]);
      off(p[face.node(s + step, t)], p[face.node(s, t + step)]);
    });
  }
  return most;
}

/// How far the chord from one node of an arc to the step-th from there is off it, by heights; or `known`, if that is
/// more.
double off_chord(const ArcBends<double>& bends, std::size_t from, std::size_t step, double known) {
  constexpr double kMostOfCubic = 0.0482;  // t (1 - t) (t - 1/2).
  double middle = std::abs(bends.middle(from, step));
  if (step == 1) middle = std::max(middle, std::abs(bends.at[std::clamp<std::size_t>(from, 1, 3) - 1]) / 8);
  const double cubic = std::abs(cubic_of(bends, step));
  if (middle + kMostOfCubic * cubic <= known) return known;
  return std::max(known, highest_over_arc(middle, cubic).height);
}

/// What triangles miss a face by, and which of its two axes, s and t, have a notable part in it: bits 0 and 1.
struct Miss {
  double most = 0;
  unsigned axes = 0;
};

/// How far triangles between every step-th node of a face miss it at most: what arcs along either side and the twist
/// tell. Across their quadrilaterals, or four of the smallest together.
Miss miss_of_face(const BlockPoints& points, const BlockShape& shape, std::size_t side) {
  const BlockFace face(side / 2, side % 2);
  const FaceArcs arcs(points, face);
  const std::size_t step = shape.step, size = std::max<std::size_t>(step, 2);
  Miss miss;
  std::array<ArcBends<double>, kBlockNodes> along_s, along_t;
  for_each_quad(size, [&](std::size_t first_s, std::size_t first_t) {
    const auto point = [&](std::size_t s, std::size_t t) -> const Vec3& { return points[face.node(s, t)]; };
    const Eigen::RowVector3d outwards =
        across_quad(shape, side / 2,
                    {point(first_s, first_t), point(first_s + size, first_t), point(first_s, first_t + size),
                     point(first_s + size, first_t + size)});
    for (std::size_t n = 0; n <= size; ++n) {
      along_s[n] = across(outwards, arcs.along_s(first_t + n));
      along_t[n] = across(outwards, arcs.along_t(first_s + n));
    }
    for (std::size_t t = first_t; t < first_t + size; t += step) {
      for (std::size_t s = first_s; s < first_s + size; s += step) {
        double of_s = 0, of_t = 0;
        for (std::size_t n = 0; n <= step; ++n) {
          of_s = off_chord(along_s[t - first_t + n], s, step, of_s);
          of_t = off_chord(along_t[s - first_s + n], t, step, of_t);
        }
        const double twist =
            0.25 *
            std::abs(outwards.dot(point(s, t) + point(s + step, t + step) - point(s + step, t) - point(s, t + step)));
        const double most = of_s + of_t + twist, least = kNotable * most;
        if (most <= miss.most) continue;
        miss = {most, (of_s + twist > least ? 1u : 0u) | (of_t + twist > least ? 2u : 0u)};
      }
    }
  });
  return miss;
}

/// Sets what the triangles between every step-th node miss.
void set_miss(const BlockPoints& points, BlockShape& shape) {
  shape.miss = shape.bulge.maxCoeff();
  shape.axes_of_miss = 0;
  for (std::size_t side = 0; side < 6; ++side) {
    const Miss miss = miss_of_face(points, shape, side);
    if (miss.most <= shape.miss) continue;
    const std::size_t s = (side / 2 + 1) % 3, t = (side / 2 + 2) % 3;
    shape.miss = miss.most;
    shape.axes_of_miss = (miss.axes & 1) << s | (miss.axes >> 1) << t;
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

Eigen::RowVector3d across_quad(const BlockShape& shape, std::size_t axis, const std::array<Vec3, 4>& corners) {
  const auto a = static_cast<Eigen::Index>(axis);
  const auto& [lower, along_s, along_t, upper] = corners;
  const Vec3 normal = (along_s + upper - lower - along_t).cross(along_t + upper - lower - along_s);
  const double along_axis = normal.dot(shape.axes.col(a));
  if (!(along_axis * shape.axes.determinant() > 0)) return shape.inverse_axes.row(a);
  return normal.transpose() / along_axis;
}

BlockShape shape_of(const BlockPoints& points) {
  constexpr std::size_t kHalf = kBlockNodes / 2, kMiddle = std::tuple_size_v<BlockPoints> / 2;
  BlockShape shape;
  for (const Vec3& point : points) shape.box.extend(point);
  for (std::size_t a = 0; a < 3; ++a) {
    shape.axes.col(static_cast<Eigen::Index>(a)) =
        points[kMiddle + kHalf * kBlockStride[a]] - points[kMiddle - kHalf * kBlockStride[a]];
  }
  shape.voxels = std::abs(shape.axes.determinant());
  shape.inverse_axes = shape.axes.inverse();
  shape.flat = !shape.inverse_axes.allFinite();
  const BlockArcs arcs(points, shape.inverse_axes);
  for (shape.step = kBlockNodes - 1; shape.step > 1; shape.step /= 2) {
    shape.bulge = arcs.bulges(shape.step);
    if (shape.bulge.maxCoeff() > kMostCoarseBulge) continue;
    if (sagitta(points, arcs, shape.step, kMostSagitta) <= kMostSagitta) break;
  }
  if (shape.step == 1) shape.bulge = arcs.bulges(1);
  set_miss(points, shape);
  return shape;
}

}  // namespace ccslice
