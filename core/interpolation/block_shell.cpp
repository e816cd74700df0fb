// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/block_shell.h"

#include <algorithm>
#include <cmath>

#include "core/interpolation/block_faces.h"

namespace ccslice {
namespace {

constexpr double kFlat = 1e-9;  // What is outside by less is flat.

/// The nodes' places across a face, outwards, as shares of the thickness.
class Heights {
 public:
  Heights(const BlockPoints& points, const BlockShape& shape, std::size_t side) : step_(shape.step) {
    const BlockFace face(side / 2, side % 2);
    const Eigen::RowVector3d outwards =
        (side % 2 != 0 ? 1 : -1) * shape.inverse_axes.row(static_cast<Eigen::Index>(side / 2));
    for (std::size_t t = 0; t < kBlockNodes; ++t) {
      for (std::size_t s = 0; s < kBlockNodes; ++s) heights_[t][s] = outwards.dot(points[face.node(s, t)]);
    }
  }

  /// How far the middle of a chord, from a node to the step-th along s, is outside of the arc.
  double over_s(std::size_t s, std::size_t t) const {
    if (step_ > 1) return 0.5 * (at(s, t) + at(s + step_, t)) - at(s + step_ / 2, t);
    // No node lies between: an eighth of the second difference at either end, whichever is more.
    return std::max(bend_s(inner(s), t), bend_s(inner(s + 1), t)) / 8;
  }
  double over_t(std::size_t s, std::size_t t) const {
    if (step_ > 1) return 0.5 * (at(s, t) + at(s, t + step_)) - at(s, t + step_ / 2);
    return std::max(bend_t(s, inner(t)), bend_t(s, inner(t + 1))) / 8;
  }
  /// The same for a diagonal of the quadrilateral: that from its lower corner, or the other one.
  double over_diagonal(std::size_t s, std::size_t t, bool from_lower) const {
    const double a = at(s, t), b = at(s + step_, t), c = at(s, t + step_), d = at(s + step_, t + step_);
    const double chord = 0.5 * (from_lower ? a + d : b + c);
    if (step_ > 1) return chord - at(s + step_ / 2, t + step_ / 2);
    const double of_corners = 0.25 * (a + b + c + d);
    return chord - of_corners + std::max(over_s(s, t), over_s(s, t + 1)) + std::max(over_t(s, t), over_t(s + 1, t));
  }

 private:
  static std::size_t inner(std::size_t n) { return std::clamp<std::size_t>(n, 1, kBlockNodes - 2); }
  double at(std::size_t s, std::size_t t) const { return heights_[t][s]; }
  double bend_s(std::size_t s, std::size_t t) const { return at(s - 1, t) - 2 * at(s, t) + at(s + 1, t); }
  double bend_t(std::size_t s, std::size_t t) const { return at(s, t - 1) - 2 * at(s, t) + at(s, t + 1); }

  std::size_t step_;
  std::array<std::array<double, kBlockNodes>, kBlockNodes> heights_;
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
    Quad quad{{face.node(s, t), face.node(s + step, t), face.node(s, t + step), face.node(s + step, t + step)}};
    const auto& [a, b, c, d] = quad.corners;
    const auto add = [&](std::size_t from, std::size_t to, double depth) {
      if (!(depth > kFlat)) return;
      places_.push_back({0.5 * (points[from] + points[to]), depth});
      quad.depth = std::max(quad.depth, depth);
    };
    // The diagonal that the triangles share, as BlockRaster chooses it.
    const bool a_to_d = (points[a] - points[d]).squaredNorm() <= (points[b] - points[c]).squaredNorm();
    add(a_to_d ? a : b, a_to_d ? d : c, heights.over_diagonal(s, t, a_to_d));
    add(a, b, heights.over_s(s, t));
    add(a, c, heights.over_t(s, t));
    add(c, d, heights.over_s(s, t + step));
    add(b, d, heights.over_t(s + step, t));
    if (!(quad.depth > 0)) return;
    quads_.push_back(quad);
    depth_ = std::max(depth_, quad.depth);
  });
}

}  // namespace ccslice
