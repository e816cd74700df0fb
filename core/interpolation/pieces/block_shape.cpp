// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/base/lanes.h"
#include "core/interpolation/fits/shares.h"
#include "core/interpolation/pieces/block_arcs.h"
#include "core/interpolation/pieces/block_faces.h"
#include "core/interpolation/pieces/face_quarters.h"

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

/// How far chords are off: `middle` and `cubic` are m and k (interpolation/pieces/block_arcs.h), without their signs.
/// The bound is no less than the height whatever is rounded, so that what it rules out needn't be known.
Lanes bounds_over_arcs(Lanes middle, Lanes cubic) {
  constexpr double kMostOfCubic = 0.0482;  // t (1 - t) (t - 1/2), and some.
  return middle + kMostOfCubic * cubic;
}
Lanes heights_over_arcs(Lanes middle, Lanes cubic) { return highest_over_arcs(middle, cubic).height; }

/// m, without its sign. With step 1 second differences at nodes count, too.
template <std::size_t Step, typename AtEnd>
Lanes bent_by(const ArcBends<Lanes>& bends, AtEnd at_end, std::size_t half) {
  const Lanes middle = absolute(middles<Step>(bends, at_end, half));
  if constexpr (Step > 1) return middle;
  const auto& [first, second, third] = bends.at;
  return greater(middle, absolute(at_end ? (half == 0 ? second : third) : first) / 8);
}

/// How far triangles between every step-th node of a face miss it: what arcs along either way and the twist tell.
/// Across its quarters, or the whole face if they are as large.
template <std::size_t Step>
class FaceMisses {
 public:
  FaceMisses(const BlockPoints& points, const BlockShape& shape, std::size_t side)
      : quarters_(points, BlockFace(side / 2, side % 2)),
        outwards_(quarters_.with_corners<std::max<std::size_t>(Step, 2)>(
            0, 0, [&](const auto&... corners) { return across_quads(shape, side / 2, corners...); })) {
    for (std::size_t n = 0; n < FaceQuarters::kNodes; ++n) {
      const ArcBends<Lanes> along_s = across(outwards_, quarters_.along_s(n)),
                            along_t = across(outwards_, quarters_.along_t(n));
      cubic_s_[n] = absolute(cubic_of(along_s, Step));
      cubic_t_[n] = absolute(cubic_of(along_t, Step));
      for (std::size_t half = 0; half < kHalves; ++half) {
        middle_s_[half][n] = bent_by<Step>(along_s, FaceQuarters::at_end_of_s(), half);
        middle_t_[half][n] = bent_by<Step>(along_t, FaceQuarters::at_end_of_t(), half);
      }
    }
  }

  /// Raises the shape's miss, and says which axes have a part in it.
  void raise(BlockShape& shape, std::size_t side) const {
    if (!may_exceed(shape.miss)) return;
    const std::size_t s = (side / 2 + 1) % 3, t = (side / 2 + 2) % 3;
    std::array<Parts, kQuads> parts;
    for (std::size_t quad = 0; quad < kQuads; ++quad) {
      parts[quad] = parts_of(quad, heights_over_arcs);
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      for (const Parts& part : parts) {
        const double of_s = part.of_s[lane], of_t = part.of_t[lane], twist = part.twist[lane];
        const double most = of_s + of_t + twist, least = kNotable * most;
        if (!(most > shape.miss)) continue;
        shape.miss = most;
        shape.axes_of_miss = (of_s + twist > least ? 1u << s : 0u) | (of_t + twist > least ? 1u << t : 0u);
      }
    }
  }

 private:
  static constexpr std::size_t kHalves = Step == 1 ? 2 : 1, kQuads = kHalves * kHalves;  // Of a quarter.

  /// What quadrilaterals at the same place in each quarter miss, by its causes.
  struct Parts {
    Lanes of_s, of_t, twist;
  };
  template <typename Off>
  Parts parts_of(std::size_t quad, const Off& off) const {
    const std::size_t s = quad % kHalves, t = quad / kHalves;
    Parts parts{};
    for (std::size_t n = 0; n <= 2 / kHalves; ++n) {
      parts.of_s = greater(parts.of_s, off(middle_s_[s][t + n], cubic_s_[t + n]));
      parts.of_t = greater(parts.of_t, off(middle_t_[t][s + n], cubic_t_[s + n]));
    }
    if constexpr (Step > 2) parts.of_s = Lanes{} + largest(parts.of_s), parts.of_t = Lanes{} + largest(parts.of_t);
    parts.twist = 0.25 * absolute(quarters_.with_corners<Step>(
                             s, t, [&](const auto& lower, const auto& along_s, const auto& along_t, const auto& upper) {
                               return outwards_.dot(lower + upper - along_s - along_t);
                             }));
    return parts;
  }
  bool may_exceed(double known) const {
    Lanes most{};
    for (std::size_t quad = 0; quad < kQuads; ++quad) {
      const Parts parts = parts_of(quad, bounds_over_arcs);
      most = greater(most, parts.of_s + parts.of_t + parts.twist);
    }
    return largest(most) > known;
  }

  const FaceQuarters quarters_;
  const LanePoints outwards_;
  std::array<Lanes, FaceQuarters::kNodes> cubic_s_, cubic_t_;                         // By the arc's node.
  std::array<std::array<Lanes, FaceQuarters::kNodes>, kHalves> middle_s_, middle_t_;  // By half, by the arc's node.
};

/// Sets what the triangles between every step-th node miss.
template <std::size_t Step>
void set_miss(const BlockPoints& points, BlockShape& shape) {
  shape.miss = shape.bulge.maxCoeff();
  shape.axes_of_miss = 0;
  for (std::size_t side = 0; side < 6; ++side) FaceMisses<Step>(points, shape, side).raise(shape, side);
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

LanePoints across_quads(const BlockShape& shape, std::size_t axis, const LanePoints& lower, const LanePoints& along_s,
                        const LanePoints& along_t, const LanePoints& upper) {
  const auto a = static_cast<Eigen::Index>(axis);
  const auto lanes = [](const auto& vector) {
    return LanePoints{Lanes{} + vector[0], Lanes{} + vector[1], Lanes{} + vector[2]};
  };
  const LanePoints normal = (along_s + upper - lower - along_t).cross(along_t + upper - lower - along_s);
  const Lanes along_axis = normal.dot(lanes(shape.axes.col(a)));
  const LanePoints middle = lanes(shape.inverse_axes.row(a));
  const auto outwards = along_axis * shape.axes.determinant() > 0;
  return {outwards ? normal.x / along_axis : middle.x, outwards ? normal.y / along_axis : middle.y,
          outwards ? normal.z / along_axis : middle.z};
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
  (shape.step == 1 ? set_miss<1> : shape.step == 2 ? set_miss<2> : set_miss<4>)(points, shape);
  return shape;
}

}  // namespace ccslice
