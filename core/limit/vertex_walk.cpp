// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/vertex_walk.h"

#include <algorithm>

namespace ccslice {

VertexWalk::VertexWalk(const OperatorTable& operators, std::size_t dimension)
    : operators_(&operators), dimension_(dimension) {
  std::size_t star = 0, own = 0, shared = 0, rows = 0;
  for (const StarOperator& op : operators.stars()) star = std::max<std::size_t>(star, op.points);
  for (const CornerOperator& op : operators.corners()) {
    own = std::max<std::size_t>(own, op.own);
    shared = std::max<std::size_t>(shared, op.shared);
    rows = std::max<std::size_t>(rows, op.stencils.rows());
  }
  shared_.reserve(shared);
  next_shared_.reserve(shared);
  points_.resize((star + own) * dimension);
  next_star_.resize(star * dimension);
  columns_.resize((shared + own + shared) * dimension);
  made_.resize(rows * dimension);
}

std::span<double> VertexWalk::start(std::uint32_t op) noexcept {
  const VertexOperator& vertex = operators_->vertices()[op];
  star_ = vertex.star;
  corner_ = vertex.corner;
  shared_.assign(vertex.shared.begin(), vertex.shared.end());
  stepped_ = children_made_ = false;
  return std::span(points_).first(point_count() * dimension_);
}

/// The star's next level follows from the star alone. What else the level holds depends on the star at both levels, as
/// far as the corner's ring shares points with it, and on the corner's own points. Outer children and the way on both
/// need this, so it is kept until the walk goes on.
void VertexWalk::step_star() noexcept {
  if (stepped_) return;
  const StarOperator& star = this->star();
  const CornerOperator& corner = this->corner();
  star.stencils.apply(0, star.points, points_.data(), dimension_, next_star_.data());
  next_shared_.clear();
  for (const std::uint32_t here : corner.carried) next_shared_.push_back(shared_[here]);
  double* out = gather_points(shared_, points_.data(), dimension_, columns_.data());
  out = std::copy_n(points_.data() + star.points * dimension_, corner.own * dimension_, out);
  gather_points(next_shared_, next_star_.data(), dimension_, out);
  stepped_ = true;
}

void VertexWalk::make_children() noexcept {
  step_star();
  if (children_made_) return;
  const PackedStencils& stencils = corner().stencils;
  stencils.apply(0, stencils.rows(), columns_.data(), dimension_, made_.data());
  children_made_ = true;
}

void VertexWalk::make(const ChildRows& child, double* out) noexcept {
  const CornerOperator& corner = this->corner();
  if (children_made_) {
    gather_points(corner.rows_of(child), made_.data(), dimension_, out);
  } else {
    corner.stencils.apply(corner.rows_of(child), columns_.data(), dimension_, out);
  }
}

void VertexWalk::descend() noexcept {
  step_star();
  const CornerOperator::Child& inner = corner().children[0];
  const std::size_t star = this->star().points * dimension_;
  std::copy_n(next_star_.data(), star, points_.data());
  make(inner, points_.data() + star);
  shared_.swap(next_shared_);
  corner_ = inner.op;
  stepped_ = children_made_ = false;
}

const CornerOperator::Child& VertexWalk::make_child(std::size_t number, double* out) noexcept {
  step_star();
  const CornerOperator::Child& child = corner().children[number];
  make(child, out);
  return child;
}

void VertexWalk::rescale(std::span<const double> origin, double scale) noexcept {
  const std::size_t count = point_count() * dimension_;
  for (std::size_t i = 0; i < count; ++i) points_[i] = scale * (points_[i] - origin[i % dimension_]);
  stepped_ = children_made_ = false;
}

}  // namespace ccslice
