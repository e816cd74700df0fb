// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/vertex_walk.h"

#include <algorithm>

namespace ccslice {
namespace {

/// Copies chosen points of `dimension` doubles each; returns the end of what it wrote.
double* gather(std::span<const std::uint32_t> chosen, const double* from, std::size_t dimension, double* out) noexcept {
  for (const std::uint32_t p : chosen) out = std::copy_n(from + p * dimension, dimension, out);
  return out;
}

}  // namespace

VertexWalk::VertexWalk(const OperatorTable& operators, std::size_t dimension)
    : operators_(&operators), dimension_(dimension) {
  std::size_t star = 0, own = 0, shared = 0;
  for (const StarOperator& op : operators.stars()) star = std::max<std::size_t>(star, op.points);
  for (const CornerOperator& op : operators.corners()) {
    own = std::max<std::size_t>(own, op.own);
    shared = std::max<std::size_t>(shared, op.shared);
  }
  shared_.reserve(shared);
  next_shared_.reserve(shared);
  points_.resize((star + own) * dimension);
  next_star_.resize(star * dimension);
  columns_.resize((shared + own + shared) * dimension);
}

std::span<double> VertexWalk::start(std::uint32_t op) noexcept {
  const VertexOperator& vertex = operators_->vertices()[op];
  star_ = vertex.star;
  corner_ = vertex.corner;
  shared_.assign(vertex.shared.begin(), vertex.shared.end());
  stepped_ = false;
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
  double* out = gather(shared_, points_.data(), dimension_, columns_.data());
  out = std::copy_n(points_.data() + star.points * dimension_, corner.own * dimension_, out);
  gather(next_shared_, next_star_.data(), dimension_, out);
  stepped_ = true;
}

void VertexWalk::descend() noexcept {
  step_star();
  const CornerOperator& corner = this->corner();
  const CornerOperator::Child& inner = corner.children[0];
  const std::size_t star = this->star().points * dimension_;
  std::copy_n(next_star_.data(), star, points_.data());
  corner.stencils.apply(inner.first_row, inner.count, columns_.data(), dimension_, points_.data() + star);
  shared_.swap(next_shared_);
  corner_ = inner.op;
  stepped_ = false;
}

const CornerOperator::Child& VertexWalk::make_child(std::size_t number, double* out) noexcept {
  step_star();
  const CornerOperator::Child& child = corner().children[number];
  corner().stencils.apply(child.first_row, child.count, columns_.data(), dimension_, out);
  return child;
}

void VertexWalk::rescale(std::span<const double> origin, double scale) noexcept {
  const std::size_t count = point_count() * dimension_;
  for (std::size_t i = 0; i < count; ++i) points_[i] = scale * (points_[i] - origin[i % dimension_]);
  stepped_ = false;
}

}  // namespace ccslice
