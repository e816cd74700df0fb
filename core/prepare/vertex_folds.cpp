// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/vertex_folds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"

namespace ccslice {
namespace {

Eigen::Vector4d limit_at_vertex(const VertexWalk& walk) {
  const StarOperator& star = walk.star();
  const Eigen::Map<const Eigen::Matrix<double, kPositionDimension, Eigen::Dynamic>> points(
      walk.points().data(), kPositionDimension, star.points);
  return points * Eigen::Map<const Eigen::VectorXd>(star.limit.data(), star.points);
}

/// P(-1) = 2 P(0) - P(1) at the ends of a line's four layers.
void fill_end_layers(const CornerOperator::Child& child, std::span<double> layers) {
  const std::size_t layer = child.layer_points * kPositionDimension;
  for (std::size_t i = 0; i < layer; ++i) {
    if (child.phantoms >> 4 & 1) layers[i] = 2 * layers[layer + i] - layers[2 * layer + i];
    if (child.phantoms >> 5 & 1) layers[3 * layer + i] = 2 * layers[2 * layer + i] - layers[layer + i];
  }
}

FoldFinding look_at_middle(double* grid, PhantomMask phantoms) {
  fill_phantoms(grid, 3, kPositionDimension, phantoms);
  bspline_to_bezier(grid, 3, kPositionDimension);
  BezierVolume net;
  for (std::size_t p = 0; p < 64; ++p) net[p] = Eigen::Vector4d::Map(grid + kPositionDimension * p);
  return FoldSearch::sample(net);
}

}  // namespace

/// A sharp edge with one cell is regular beside the vertex: the boundary on both sides of it is made of phantoms.
bool VertexFolds::has_sharp_edge(const CornerOperator& corner) const {
  constexpr PhantomMask kLowSides = 0b010101;
  return std::any_of(corner.children.begin() + 1, corner.children.end(), [&](const CornerOperator::Child& child) {
    if (child.cell_class == CellClass::kLine) return lines_.is_sharp(child.op);
    return std::popcount(static_cast<unsigned>(child.phantoms & kLowSides)) > 1;
  });
}

/// The child's determinant is by its own parameters, two to each of its parent's.
FoldFinding VertexFolds::examine_child(VertexWalk& walk, std::size_t number) {
  const CornerOperator::Child& child = walk.corner().children[number];
  const bool is_line = child.cell_class == CellClass::kLine;
  child_.resize(kPositionDimension * (is_line ? std::size_t{4} * child.layer_points : 64));
  walk.make_child(number, child_.data());
  if (!is_line) return look_at_middle(child_.data(), child.phantoms);
  fill_end_layers(child, child_);
  return lines_.examine(child.op, child_,
                        lines_.is_sharp(child.op) ? LineFolds::Views::kAll : LineFolds::Views::kFirst);
}

FoldFinding VertexFolds::examine(VertexWalk walk) {
  constexpr std::array<double, kPositionDimension> kOrigin{};
  Vec3 vertex = Vec3::Zero();
  FoldFinding worst;
  for (int level = 0; level < kLevels && worst.verdict != FoldVerdict::kFolds; ++level) {
    const Eigen::Vector4d limit = limit_at_vertex(walk);
    // After the first time this takes off rounding only. Points are doubled at each level, as its parameters are, so
    // that derivatives by these stay those by the parameters of the given (sub-)cell. A child's are twice as large
    // again, and its determinant an eighth.
    walk.rescale(std::span(limit.data(), kPositionDimension), 1);
    vertex += std::ldexp(1.0, -level) * limit.head<3>();
    for (std::size_t child = 1; child < 8; ++child) {
      const FoldFinding found = examine_child(walk, child);
      const FoldVerdict verdict = std::max(worst.verdict, found.verdict);
      if (8 * found.determinant < worst.determinant) {
        worst = {verdict, 8 * found.determinant, vertex + std::ldexp(1.0, -level) * found.position};
      }
      worst.verdict = verdict;
    }
    walk.descend();
    walk.rescale(kOrigin, 2);
  }
  return worst;
}

}  // namespace ccslice
