// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/vertex_folds.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"

namespace ccslice {
namespace {

/// Moves the points so that the limit at the vertex is the origin. Returns where it was.
Vec3 move_to_origin(const VertexOperator& vertex, std::span<double> ring) {
  Eigen::Map<Eigen::Matrix<double, kPositionDimension, Eigen::Dynamic>> points(ring.data(), kPositionDimension,
                                                                               vertex.points);
  const Eigen::Map<const Eigen::VectorXd> weights(vertex.limit.data(), vertex.points);
  const Eigen::Vector4d limit = points * weights;
  points.colwise() -= limit;
  return limit.head<3>();
}

/// P(-1) = 2 P(0) - P(1) at the ends of a line's four layers.
void fill_end_layers(const VertexOperator::Child& child, std::span<double> layers) {
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
bool VertexFolds::has_sharp_edge(std::uint32_t op) const {
  constexpr PhantomMask kLowSides = 0b010101;
  const auto& children = data_.operators.vertices()[op].children;
  return std::any_of(children.begin() + 1, children.end(), [&](const VertexOperator::Child& child) {
    if (child.cell_class == CellClass::kLine) return lines_.is_sharp(child.op);
    return std::popcount(static_cast<unsigned>(child.phantoms & kLowSides)) > 1;
  });
}

/// The child's determinant is by its own parameters, two to each of its parent's.
FoldFinding VertexFolds::examine_child(const VertexOperator& now, std::size_t child) {
  const VertexOperator::Child& next = now.children[child];
  const bool is_line = next.cell_class == CellClass::kLine;
  next_.resize(kPositionDimension * (is_line ? std::size_t{4} * next.layer_points : 64));
  now.stencils.apply(next.first_row, next.count, ring_.data(), kPositionDimension, next_.data());
  if (!is_line) return look_at_middle(next_.data(), next.phantoms);
  fill_end_layers(next, next_);
  return lines_.examine(next.op, next_, lines_.is_sharp(next.op) ? LineFolds::Views::kAll : LineFolds::Views::kFirst);
}

FoldFinding VertexFolds::examine(std::uint32_t op, std::span<const double> ring) {
  const auto& vertices = data_.operators.vertices();
  ring_.assign(ring.begin(), ring.end());
  Vec3 vertex = Vec3::Zero();
  FoldFinding worst;
  for (int level = 0; level < kLevels && worst.verdict != FoldVerdict::kFolds; ++level) {
    const VertexOperator& now = vertices[op];
    vertex += std::ldexp(1.0, -level) * move_to_origin(now, ring_);
    for (std::size_t child = 1; child < 8; ++child) {
      const FoldFinding found = examine_child(now, child);
      const FoldVerdict verdict = std::max(worst.verdict, found.verdict);
      if (8 * found.determinant < worst.determinant) {
        worst = {verdict, 8 * found.determinant, vertex + std::ldexp(1.0, -level) * found.position};
      }
      worst.verdict = verdict;
    }
    const VertexOperator::Child& inner = now.children[0];
    next_.resize(kPositionDimension * inner.count);
    now.stencils.apply(inner.first_row, inner.count, ring_.data(), kPositionDimension, next_.data());
    for (double& x : next_) x *= 2;
    ring_.swap(next_);
    op = inner.op;
  }
  return worst;
}

}  // namespace ccslice
