// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/patch_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/patch.h"

namespace ccslice {

namespace {

/// Levels to descend before `largest` reaches [1/2, 1]. ilogb() is floor(log2()) and exact, and so is scaling by a
/// power of two: 1/2 itself always falls to the outer sub-cell, and only beyond kMaxPatchLevel is child 0 left over.
int level_of(double largest) noexcept {
  if (largest >= 0.5) return 0;
  if (largest <= 0) return kMaxPatchLevel;
  return std::min(-std::ilogb(largest) - 1, kMaxPatchLevel);
}

/// Chooses the half of each of the first `axes` coordinates and rescales them to it.
std::uint8_t choose_child(Vec3& q, int axes) noexcept {
  unsigned child = 0;
  for (int a = 0; a < axes; ++a) {
    const bool outer = q[a] >= 0.5;
    child |= static_cast<unsigned>(outer) << a;
    q[a] = std::clamp(2 * q[a] - outer, 0.0, 1.0);
  }
  return static_cast<std::uint8_t>(child);
}

void find_in_line(PatchPlace& place) noexcept {
  Vec3& q = place.local;
  const int level = level_of(std::max(q[0], q[1]));
  place.path.line_level = static_cast<std::uint8_t>(level);
  const double scale = std::ldexp(1.0, level);
  q[0] *= scale;
  q[1] *= scale;
  place.path.line_child = choose_child(q, 2);
  if (place.path.line_child == 0) {
    // Limit rows say what is here. The patch on the diagonal stands in for the Jacobian.
    place.at_line = true;
    place.path.line_child = 3;
    q[0] = q[1] = 0;
  }
  // In a patch of level n, u and v are local = 2^(n+1) * cell - const; w is the cell's own.
  place.factor[0] *= 2 * scale;
  place.factor[1] *= 2 * scale;
}

void enter_frame(const Frame& frame, PatchPlace& place) noexcept {
  const double by_x = place.factor[0], by_y = place.factor[1], by_z = place.factor[2];
  const auto [x, y, z] = place.axis;
  const auto factor = [&](std::size_t a) {
    const double per_cell = frame.along(a, by_x, by_y, by_z);
    return frame.is_mirrored(a) ? -per_cell : per_cell;
  };
  place.local = frame.to_framed(place.local);
  place.factor = {factor(0), factor(1), factor(2)};
  place.axis = {frame.along(0, x, y, z), frame.along(1, x, y, z), frame.along(2, x, y, z)};
}

}  // namespace

/// By the chain rule: dX/d(cell) = dX/d(local) * d(local)/d(cell).
LimitSample in_cell(const PatchPlace& place, const LimitSample& local) noexcept {
  LimitSample sample{local.position, {}};
  for (int a = 0; a < 3; ++a) {
    sample.jacobian.col(place.axis[static_cast<std::size_t>(a)]) = place.factor[a] * local.jacobian.col(a);
  }
  return sample;
}

const CornerOperator::Child& sub_cell_of(const LimitSolid::Data& data, const LimitCell& cell,
                                         const PatchPath& path) noexcept {
  const std::vector<CornerOperator>& corners = data.operators.corners();
  std::uint32_t op = data.operators.vertices()[cell.op].corner;
  for (int n = 0; n < path.level; ++n) op = corners[op].children[0].op;
  return corners[op].children[path.child];
}

PatchPlace find_patch(const LimitSolid::Data& data, const LimitCell& cell, const Vec3& uvw) noexcept {
  PatchPlace place{{}, uvw, {0, 1, 2}, Vec3::Ones()};
  if (cell.cell_class == CellClass::kRegular) return place;
  enter_frame(cell.frame, place);
  if (cell.cell_class == CellClass::kLine) {
    find_in_line(place);
    return place;
  }
  const int level = level_of(place.local.maxCoeff());
  place.path.level = static_cast<std::uint8_t>(level);
  place.local *= std::ldexp(1.0, level);
  place.factor *= std::ldexp(2.0, level);
  place.path.child = choose_child(place.local, 3);
  if (place.path.child == 0) {
    place.at_vertex = true;
    place.path.child = 7;
    place.local.setZero();
  }
  const CornerOperator::Child& child = sub_cell_of(data, cell, place.path);
  if (child.cell_class == CellClass::kLine) {
    enter_frame(child.frame, place);
    find_in_line(place);
  }
  return place;
}

PatchBuilder::PatchBuilder(const LimitSolid::Data& data, std::size_t dimension)
    : data_(data),
      dimension_(dimension),
      a_(data.operators.max_ring_points() * dimension),
      b_(a_.size()),
      visited_(data.operators, dimension),
      grid_(64 * dimension),
      walk_(data.operators, dimension) {
  line_layers_.reserve(a_.size());
  deep_layers_.resize(a_.size());
}

void PatchBuilder::gather(const LimitCell& cell, double* out) const noexcept {
  const std::size_t count = std::min(dimension_, data_.dimension);
  data_.for_each_point(cell, [&](std::size_t, std::uint32_t id) {
    if (id == kNone) {
      std::fill(out, out + dimension_, 0.0);
    } else {
      const double* point = data_.point(id);  // A few numbers: a call to copy them would take longer than they do.
      for (std::size_t d = 0; d < count; ++d) out[d] = point[d];
      for (std::size_t d = count; d < dimension_; ++d) out[d] = 0;
    }
    out += dimension_;
  });
}

void PatchBuilder::walk_to(const LimitCell& cell, int level) noexcept {
  // A step can't be taken back, as its matrix need not have an inverse: a level that is behind starts anew.
  if (walked_ != &cell || walked_level_ > level) {
    gather(cell, walk_.start(cell.op).data());
    walked_ = &cell;
    walked_level_ = 0;
  }
  for (; walked_level_ < level; ++walked_level_) walk_.descend();
}

const CornerOperator::Child& PatchBuilder::descend_vertex(const LimitCell& cell, const PatchPath& path) noexcept {
  walk_to(cell, path.level);
  return walk_.make_child(path.child, a_.data());
}

std::span<const double> PatchBuilder::points_of_rest(const LimitCell& cell, const PatchPath& path) noexcept {
  if (cell.cell_class == CellClass::kVertex && path.child == 0) {
    walk_to(cell, path.level);
    return walk_.points();
  }
  return layers_of(descend_line(copy_line(cell, path), path.line_level));
}

/// P(-1) = 2 P(0) - P(1) for whole layers. Planar stencils act on every layer alike and so commute with it: phantom
/// layers that are filled before the walk along the line are right at each of its levels.
void PatchBuilder::fill_layers(std::uint32_t layer_points, PhantomMask phantoms) noexcept {
  const std::size_t layer = layer_points * dimension_;
  double* p = a_.data();
  for (std::size_t i = 0; i < layer; ++i) {
    if (phantoms >> 4 & 1) p[i] = 2 * p[layer + i] - p[2 * layer + i];
    if (phantoms >> 5 & 1) p[3 * layer + i] = 2 * p[2 * layer + i] - p[layer + i];
  }
}

std::uint32_t PatchBuilder::load_line(const LimitCell& cell, const PatchPath& path) noexcept {
  if (line_.cell == &cell && line_.level == path.level && line_.child == path.child) return line_.op;
  std::uint32_t layer_points = 0;
  line_ = {.cell = &cell, .level = path.level, .child = path.child, .op = cell.op};
  if (cell.cell_class == CellClass::kLine) {
    layer_points = data_.operators.lines()[cell.op].points;
    gather(cell, a_.data());
    fill_layers(layer_points, cell.phantoms);
  } else {
    const CornerOperator::Child& child = descend_vertex(cell, path);
    layer_points = child.layer_points;
    fill_layers(layer_points, child.phantoms);
    line_.op = child.op;
  }
  line_layers_.assign(a_.begin(), a_.begin() + static_cast<std::ptrdiff_t>(4 * layer_points * dimension_));
  return line_.op;
}

std::span<const double> PatchBuilder::line_layers(const LimitCell& cell, const PatchPath& path) noexcept {
  load_line(cell, path);
  return line_layers_;
}

std::uint32_t PatchBuilder::copy_line(const LimitCell& cell, const PatchPath& path) noexcept {
  const std::uint32_t op = load_line(cell, path);
  std::copy(line_layers_.begin(), line_layers_.end(), a_.begin());
  return op;
}

/// The cell is a planar scheme times a B-spline: the same stencils act on all four layers, and w stays the cell's own.
std::uint32_t PatchBuilder::descend_line(std::uint32_t op, int levels, std::vector<double>& layers) noexcept {
  for (int n = 0; n < levels; ++n) {
    const PlanarOperator& now = data_.operators.lines()[op];
    const ChildRows& next = now.children[0];
    now.stencils.apply_to_layers(now.rows_of(next), layers.data(), now.points, dimension_, b_.data());
    std::swap(layers, b_);
    op = next.op;
  }
  return op;
}

std::uint32_t PatchBuilder::walk_line_to(const LimitCell& cell, const PatchPath& path) noexcept {
  load_line(cell, path);
  if (line_.deep_level == 0 || line_.deep_level > path.line_level) {
    std::copy(line_layers_.begin(), line_layers_.end(), deep_layers_.begin());
    line_.deep_level = 0;
    line_.deep_op = line_.op;
  }
  line_.deep_op = descend_line(line_.deep_op, path.line_level - line_.deep_level, deep_layers_);
  line_.deep_level = path.line_level;
  return line_.deep_op;
}

void PatchBuilder::finish_line(std::uint32_t op, std::uint8_t child, const std::vector<double>& layers,
                               double* grid) noexcept {
  const PlanarOperator& now = data_.operators.lines()[op];
  const ChildRows& next = now.children[child];
  now.stencils.apply_to_layers(now.rows_of(next), layers.data(), now.points, dimension_, grid);
  fill_phantoms(grid, 3, dimension_, next.phantoms);
}

void PatchBuilder::pick_layers(const PlanarOperator& line, const ChildRows& child, double* out) const noexcept {
  const std::size_t layer = line.stencils.rows() * dimension_;
  for (std::size_t l = 0; l < 4; ++l) out = gather_points(line.rows_of(child), b_.data() + l * layer, dimension_, out);
}

void PatchBuilder::build(const LimitCell& cell, const PatchPath& path, double* grid) noexcept {
  if (cell.cell_class == CellClass::kRegular) {
    gather(cell, grid);
    fill_phantoms(grid, 3, dimension_, cell.phantoms);
  } else if (path.line_child != 0) {
    const std::uint32_t op = walk_line_to(cell, path);
    finish_line(op, path.line_child, deep_layers_, grid);
  } else {
    const CornerOperator::Child& child = descend_vertex(cell, path);
    std::copy_n(a_.data(), 64 * dimension_, grid);
    fill_phantoms(grid, 3, dimension_, child.phantoms);
  }
}

void PatchBuilder::limit_at_vertex(const LimitCell& cell, double* out) noexcept {
  std::fill(out, out + dimension_, 0.0);
  const auto& limit = data_.operators.stars()[data_.operators.vertices()[cell.op].star].limit;
  const auto star = data_.star(cell);
  for (std::size_t i = 0; i < star.size(); ++i) {
    for (std::size_t d = 0; d < dimension_; ++d) out[d] += limit[i] * data_.point(star[i])[d];
  }
}

/// The planar limit row, layer by layer, yields four control points of the line, a cubic B-spline in w.
void PatchBuilder::limit_at_line(const LimitCell& cell, const PatchPath& path, double w, double* out) noexcept {
  const std::uint32_t op = load_line(cell, path);
  const auto& limit = data_.operators.lines()[op].limit;
  std::array<double, 4> basis, unused;
  bspline_basis(w, basis, unused);
  std::fill(out, out + dimension_, 0.0);
  const double* p = line_layers_.data();
  for (std::size_t layer = 0; layer < 4; ++layer) {
    for (const double weight : limit) {
      for (std::size_t d = 0; d < dimension_; ++d) out[d] += basis[layer] * weight * *p++;
    }
  }
}

}  // namespace ccslice
