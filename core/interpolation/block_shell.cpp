// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/block_shell.h"

#include <algorithm>
#include <cmath>

#include "core/interpolation/block_faces.h"

namespace ccslice {
namespace {

constexpr double kFlat = 1e-9;  // What is outside by less is flat.

/// How far a chord is outside at most, and at which share of the way from its one end to the other.
struct Deepest {
  double depth, share;
};

/// The nodes' places across a face, outwards, as shares of the thickness.
class Heights {
 public:
  using Line = std::array<double, kBlockNodes>;

  Heights(const BlockPoints& points, const BlockShape& shape, std::size_t side) : step_(shape.step) {
    const BlockFace face(side / 2, side % 2);
    const Eigen::RowVector3d outwards =
        (side % 2 != 0 ? 1 : -1) * shape.inverse_axes.row(static_cast<Eigen::Index>(side / 2));
    for (std::size_t t = 0; t < kBlockNodes; ++t) {
      for (std::size_t s = 0; s < kBlockNodes; ++s) heights_[t][s] = outwards.dot(points[face.node(s, t)]);
    }
  }

  /// Where a chord, from a node to the step-th along s, is farthest outside of the arc.
  Deepest over_s(std::size_t s, std::size_t t) const { return over_arc(along_s(t), s); }
  Deepest over_t(std::size_t s, std::size_t t) const { return over_arc(along_t(s), t); }
  /// The same for a diagonal of the quadrilateral: that from its lower corner, or the other one.
  Deepest over_diagonal(std::size_t s, std::size_t t, bool from_lower) const {
    if (step_ == kBlockNodes - 1) {
      Line line;
      for (std::size_t n = 0; n < kBlockNodes; ++n) line[n] = at(n, from_lower ? n : step_ - n);
      return over_arc(line, 0);
    }
    const double a = at(s, t), b = at(s + step_, t), c = at(s, t + step_), d = at(s + step_, t + step_);
    const double chord = 0.5 * (from_lower ? a + d : b + c);
    if (step_ > 1) {
      return deepest(chord - at(s + 1, t + 1), cubic_over(along_s(t + 1)) + cubic_over(along_t(s + 1)));
    }
    const double of_corners = 0.25 * (a + b + c + d);
    const double arcs =
        std::max(over_s(s, t).depth, over_s(s, t + 1).depth) + std::max(over_t(s, t).depth, over_t(s + 1, t).depth);
    return {chord - of_corners + arcs, 0.5};
  }

 private:
  static std::size_t inner(std::size_t n) { return std::clamp<std::size_t>(n, 1, kBlockNodes - 2); }
  double at(std::size_t s, std::size_t t) const { return heights_[t][s]; }
  const Line& along_s(std::size_t t) const { return heights_[t]; }
  Line along_t(std::size_t s) const {
    Line line;
    for (std::size_t n = 0; n < kBlockNodes; ++n) line[n] = at(s, n);
    return line;
  }

  Deepest over_arc(const Line& line, std::size_t from) const {
    if (step_ == kBlockNodes - 1) {  // All nodes lie between its ends.
      Deepest most{0, 0.5};
      for (std::size_t n = 1; n + 1 < kBlockNodes; ++n) {
        const double share = static_cast<double>(n) / static_cast<double>(step_);
        const double depth = (1 - share) * line.front() + share * line.back() - line[n];
        if (depth > most.depth) most = {depth, share};
      }
      return most;
    }
    if (step_ > 1) return deepest(0.5 * (line[from] + line[from + step_]) - line[from + 1], cubic_over(line));
    // No node lies between: an eighth of the second difference at either end, whichever is more.
    const auto bend = [&](std::size_t n) { return line[n - 1] - 2 * line[n] + line[n + 1]; };
    return deepest(std::max(bend(inner(from)), bend(inner(from + 1))) / 8, cubic_over(line));
  }

  /// How far an arc with an inflection leaves its chord, by its third differences: t (t - 1/2) (t - 1), which is 0 in
  /// the middle, is 0.048 at t = 0.21.
  double cubic_over(const Line& line) const {
    const double rising = line[3] - 3 * line[2] + 3 * line[1] - line[0];
    const double falling = line[4] - 3 * line[3] + 3 * line[2] - line[1];
    const auto length = static_cast<double>(step_);
    return 0.0482 / 6 * length * length * length * std::max(std::abs(rising), std::abs(falling));
  }
  /// Chooses between the arc's middle, where a parabola is deepest, and a fifth of its length, where a parabola has two
  /// thirds of its depth and a cubic adds to that.
  static Deepest deepest(double in_middle, double of_cubic) {
    const double at_fifth = 2.0 / 3 * in_middle + of_cubic;
    return at_fifth > in_middle && of_cubic > kFlat ? Deepest{at_fifth, 0.21} : Deepest{in_middle, 0.5};
  }

  std::size_t step_;
  std::array<Line, kBlockNodes> heights_;  // Along s, one after the other.
};

}  // namespace

void BlockShell::find(const BlockPoints& points, const BlockShape& shape, std::size_t side) {
  depth_ = 0;
  places_.clear();
  quads_.clear();
  const BlockFace face(side / 2, side % 2);
  const Heights heights(points, shape, side);
  const std::size_t step = shape.step;
  for_each_quad(step, [&](std::size_t s, std::size_t t) {
    const std::size_t a = face.node(s, t), b = face.node(s + step, t), c = face.node(s, t + step),
                      d = face.node(s + step, t + step);
    // The diagonal that the triangles share, as BlockRaster chooses it.
    const bool a_to_d = (points[a] - points[d]).squaredNorm() <= (points[b] - points[c]).squaredNorm();
    Quad quad;
    quad.corners = a_to_d ? std::array{a, b, c, d} : std::array{b, a, d, c};
    const auto add = [&](std::size_t from, std::size_t to, const Deepest& most, bool is_its_own = true) {
      if (!(most.depth > kFlat)) return;
      if (is_its_own) places_.push_back({(1 - most.share) * points[from] + most.share * points[to], most.depth});
      quad.depth = std::max(quad.depth, most.depth);
    };
    add(a_to_d ? a : c, a_to_d ? d : b, heights.over_diagonal(s, t, a_to_d));
    add(a, b, heights.over_s(s, t));
    add(a, c, heights.over_t(s, t));
    // The edges at its ends are the next one's, if there is one.
    add(c, d, heights.over_s(s, t + step), t + step + 1 == kBlockNodes);
    add(b, d, heights.over_t(s + step, t), s + step + 1 == kBlockNodes);
    if (!(quad.depth > 0)) return;
    quads_.push_back(quad);
    depth_ = std::max(depth_, quad.depth);
  });
}

}  // namespace ccslice
