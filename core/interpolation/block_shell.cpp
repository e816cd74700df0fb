// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/block_shell.h"

#include <algorithm>
#include <cmath>

#include "core/interpolation/block_arcs.h"
#include "core/interpolation/block_faces.h"

namespace ccslice {
namespace {

constexpr double kFlat = 1e-9;  // What is outside by less is flat.

/// How far a face's chords are outside of it, along rows across it.
class FaceHeights {
 public:
  FaceHeights(const BlockPoints& points, const BlockFace& face, std::size_t step)
      : points_(points), face_(face), step_(step), arcs_(points, face) {}

  /// Where a chord, from a node to the step-th along s, is farthest outside of the arc. `outwards`: voxels -> shares of
  /// the block's thickness.
  HighestOverArc over_s(const Eigen::RowVector3d& outwards, std::size_t s, std::size_t t) const {
    return over_arc(across(outwards, arcs_.along_s(t)), s);
  }
  HighestOverArc over_t(const Eigen::RowVector3d& outwards, std::size_t s, std::size_t t) const {
    return over_arc(across(outwards, arcs_.along_t(s)), t);
  }
  /// The same for a diagonal of the quadrilateral: that from its lower corner, or the other one, towards larger s.
  /// `of_sides`: what the larger heights of its sides come to along s and along t.
  HighestOverArc over_diagonal(const Eigen::RowVector3d& outwards, std::size_t s, std::size_t t, bool from_lower,
                               double of_sides) const {
    if (step_ == kBlockNodes - 1) {
      return over_arc(across(outwards, bends_of<Vec3>([&](std::size_t n) -> const Vec3& {
                               return points_[face_.node(n, from_lower ? n : step_ - n)];
                             })),
                      0);
    }
    const auto at = [&](std::size_t right, std::size_t up) {
      return outwards.dot(points_[face_.node(s + right, t + up)]);
    };
    const double a = at(0, 0), b = at(step_, 0), c = at(0, step_), d = at(step_, step_);
    const double chord = 0.5 * (from_lower ? a + d : b + c);
    if (step_ > 1) {
      const double along_s = cubic_of(across(outwards, arcs_.along_s(t + 1)), step_),
                   along_t = cubic_of(across(outwards, arcs_.along_t(s + 1)), step_) * (from_lower ? 1 : -1);
      const double cubic = std::copysign(std::abs(along_s) + std::abs(along_t), along_s + along_t);
      return or_middle(chord - at(1, 1), cubic);
    }
    const double of_corners = 0.25 * (a + b + c + d);
    return {chord - of_corners + of_sides, 0.5};
  }

 private:
  static std::size_t inner(std::size_t n) { return std::clamp<std::size_t>(n, 1, kBlockNodes - 2) - 1; }

  /// What the middle has, below 0, of a chord that is nowhere outside.
  static HighestOverArc or_middle(double middle, double cubic) {
    const HighestOverArc highest = highest_over_arc(middle, cubic);
    return highest.height > 0 ? highest : HighestOverArc{middle, 0.5};
  }

  HighestOverArc over_arc(const ArcBends<double>& bends, std::size_t from) const {
    const auto& [first, second, third] = bends.at;
    if (step_ == kBlockNodes - 1) {  // All nodes lie between its ends.
      HighestOverArc most{0, 0.5};
      const std::array<double, 3> heights = {(3 * first + 2 * second + third) / 4, (first + 2 * second + third) / 2,
                                             (first + 2 * second + 3 * third) / 4};
      for (std::size_t n = 0; n < heights.size(); ++n) {
        if (heights[n] > most.height) most = {heights[n], static_cast<double>(n + 1) / static_cast<double>(step_)};
      }
      return most;
    }
    double middle = bends.middle(from, step_);
    if (step_ == 1) middle = std::max({middle, bends.at[inner(from)] / 8, bends.at[inner(from + 1)] / 8});
    return or_middle(middle, cubic_of(bends, step_));
  }

  const BlockPoints& points_;
  const BlockFace face_;
  const std::size_t step_;
  const FaceArcs arcs_;
};

}  // namespace

void BlockShell::find(const BlockPoints& points, const BlockShape& shape, std::size_t side) {
  depth_ = 0;
  places_.clear();
  quads_.clear();
  const BlockFace face(side / 2, side % 2);
  const std::size_t step = shape.step;
  const FaceHeights heights(points, face, step);
  for_each_quad(step, [&](std::size_t s, std::size_t t) {
    const std::size_t a = face.node(s, t), b = face.node(s + step, t), c = face.node(s, t + step),
                      d = face.node(s + step, t + step);
    // The diagonal that the triangles share, as BlockRaster chooses it.
    const bool a_to_d = (points[a] - points[d]).squaredNorm() <= (points[b] - points[c]).squaredNorm();
    const Eigen::RowVector3d outwards =
        (side % 2 != 0 ? 1 : -1) * across_quad(shape, side / 2, {points[a], points[b], points[c], points[d]});
    Quad quad;
    quad.outwards = outwards;
    quad.corners = a_to_d ? std::array{a, b, c, d} : std::array{b, a, d, c};
    const auto add = [&](std::size_t from, std::size_t to, const HighestOverArc& most, bool is_its_own = true) {
      if (!(most.height > kFlat)) return;
      if (is_its_own) {
        places_.push_back({(1 - most.share) * points[from] + most.share * points[to], outwards, most.height});
      }
      quad.depth = std::max(quad.depth, most.height);
    };
    const HighestOverArc ab = heights.over_s(outwards, s, t), cd = heights.over_s(outwards, s, t + step),
                         ac = heights.over_t(outwards, s, t), bd = heights.over_t(outwards, s + step, t);
    const double of_sides = std::max(ab.height, cd.height) + std::max(ac.height, bd.height);
    add(a_to_d ? a : c, a_to_d ? d : b, heights.over_diagonal(outwards, s, t, a_to_d, of_sides));
    add(a, b, ab);
    add(a, c, ac);
    // The edges at its ends are the next one's, if there is one.
    add(c, d, cd, t + step + 1 == kBlockNodes);
    add(b, d, bd, s + step + 1 == kBlockNodes);
    if (!(quad.depth > 0)) return;
    quads_.push_back(quad);
    depth_ = std::max(depth_, quad.depth);
  });
}

}  // namespace ccslice
