// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_stencils.h"

#include <algorithm>
#include <utility>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"

namespace ccslice {
namespace {

/// Places [begin, end) in the order of their patches.
struct Range {
  std::size_t begin = 0, end = 0;
};

/// Weights of points, row by row, at places: column n is the n-th place in the order of patches.
class WeightTable {
 public:
  WeightTable(std::size_t points, const Range& places) : places_(places), rows_(points * width(), 0.0) {}

  double* row(std::size_t point) { return rows_.data() + point * width(); }
  const double* row(std::size_t point) const { return rows_.data() + point * width(); }
  double& at(std::size_t point, std::size_t place) { return row(point)[place - places_.begin]; }
  std::size_t width() const { return places_.end - places_.begin; }

  /// row(to) += weight * from's row, where the places of `from` are among ours.
  void add(std::size_t to, double weight, const WeightTable& from, std::size_t point) {
    double* target = row(to) + (from.places_.begin - places_.begin);
    const double* source = from.row(point);
    for (std::size_t n = 0; n < from.width(); ++n) target[n] += weight * source[n];
  }

  /// REQUIRES: the same places everywhere.
  void set_product(std::size_t to, const double* a, const double* b) {
    double* target = row(to);
    for (std::size_t n = 0; n < width(); ++n) target[n] = a[n] * b[n];
  }

  /// Gives the points these weights at each of the places.
  void set_columns(const Range& places, const std::vector<double>& weights) {
    for (std::size_t p = 0; p < weights.size(); ++p) {
      for (std::size_t n = places.begin; n < places.end; ++n) at(p, n) = weights[p];
    }
  }

  /// What points weigh by way of the point `made_point` that a row makes of them. REQUIRES: the places of `made` are
  /// among ours.
  void add_by_way_of(const PackedStencils& stencils, std::uint32_t row, const WeightTable& made,
                     std::size_t made_point) {
    stencils.for_each(row, [&](std::uint32_t column, double weight) { add(column, weight, made, made_point); });
  }
  /// By way of a child's points, which are the points of `made` from `first_made` on.
  void add_by_way_of(const ChildStencils& parent, const ChildRows& child, const WeightTable& made,
                     std::size_t first_made = 0) {
    for (const std::uint32_t row : parent.rows_of(child)) add_by_way_of(parent.stencils, row, made, first_made++);
  }

  /// A phantom point is 2 * near - far: what it weighs, those weigh.
  void move_phantom(std::size_t phantom, std::size_t near, std::size_t far) {
    add(near, 2, *this, phantom);
    add(far, -1, *this, phantom);
    std::fill_n(row(phantom), width(), 0.0);
  }

 private:
  Range places_;
  std::vector<double> rows_;
};

/// The transpose of fill_phantoms(), of four points along each of `axes` axes.
void move_phantoms(WeightTable& grid, std::size_t axes, PhantomMask phantoms) {
  // Transposed, a product has its factors in the opposite order: the last axis comes first.
  for (std::size_t axis = axes; axis-- > 0;) {
    const std::size_t stride = std::size_t{1} << (2 * axis);
    for (std::size_t p = 0; p < std::size_t{1} << (2 * axes); ++p) {
      if (p / stride % 4 != 0) continue;
      if (phantoms >> (2 * axis) & 1) grid.move_phantom(p, p + stride, p + 2 * stride);
      if (phantoms >> (2 * axis + 1) & 1) grid.move_phantom(p + 3 * stride, p + 2 * stride, p + stride);
    }
  }
}

/// The ring of a vertex cell at a level.
struct VertexLevel {
  const StarOperator& star;
  std::uint32_t corner;
  std::span<const std::uint32_t> shared;  // Numbers in the star of the corner's shared points.
};

/// Goes from the patches up to the ring. Places are sorted by depth, so that all that lie below a level are the first
/// ones of those at it: one table holds them, and each level is one pass over rows of neighbouring columns.
class StencilWalk {
 public:
  StencilWalk(const LimitSolid::Data& data, const LimitCell& cell, std::span<const Vec3> framed) : data_(data) {
    LimitCell in_frame = cell;
    in_frame.frame = {};  // Places come in the cell's frame already.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    std::vector<PatchPlace> found;
    for (std::uint32_t n = 0; n < framed.size(); ++n) {
      found.push_back(find_patch(data, in_frame, framed[n]));
      order.emplace_back(depth_order(found.back()), n);
    }
    std::sort(order.begin(), order.end());
    columns_.resize(framed.size());
    for (const auto& [key, n] : order) {
      columns_[n] = places_.size();
      places_.push_back(found[n]);
    }
  }

  WeightTable weights_of(const LimitCell& cell) const {
    const Range all{0, places_.size()};
    if (cell.cell_class == CellClass::kLine) {
      return of_line_ring(cell.op, data_.operators.lines()[cell.op].points, cell.phantoms, all);
    }
    return of_vertex_ring(data_.operators.vertices()[cell.op], all);
  }

  /// The n-th place asked for.
  std::size_t column(std::size_t n) const { return columns_[n]; }

 private:
  const PatchPlace& place(std::size_t n) const { return places_[n]; }

  /// The irregular place itself first, then from the deepest level on.
  static std::uint64_t depth_order(const PatchPlace& at) {
    constexpr std::uint64_t kDeepest = kMaxPatchLevel;
    const PatchPath& path = at.path;
    const std::uint64_t sub_cell = std::uint64_t{!at.at_vertex} << 16 | (kDeepest - path.level) << 8 | path.child;
    return sub_cell << 24 | std::uint64_t{!at.at_line} << 16 | (kDeepest - path.line_level) << 8 | path.line_child;
  }

  /// The range's first places, as far as the predicate holds.
  template <typename Predicate>
  Range prefix(const Range& range, Predicate holds) const {
    Range result{range.begin, range.begin};
    while (result.end < range.end && holds(place(result.end))) ++result.end;
    return result;
  }

  /// REQUIRES: a vertex cell's places.
  WeightTable of_vertex_ring(const VertexOperator& op, const Range& range) const {
    const StarOperator& star = data_.operators.stars()[op.star];
    WeightTable table = below_vertex({star, op.corner, op.shared}, 0, range);
    table.set_columns(prefix(range, [](const PatchPlace& at) { return at.at_vertex; }), star.limit);
    return table;
  }

  /// Weights of the ring at a level, the star's points first, at places that lie as deep; zero at the vertex itself.
  ///
  /// A step down (VertexWalk) makes the star one level on of the star, and the child's own points and the outer
  /// children of the columns: shared points, own points, and shared points of the star one level on. Transposed,
  /// weights go from children to columns, then from columns and the child at the vertex to the star one level on, and
  /// then to the star.
  WeightTable below_vertex(const VertexLevel& at_level, int level, const Range& range) const {
    const CornerOperator& corner = data_.operators.corners()[at_level.corner];
    const std::size_t star_points = at_level.star.points;
    std::vector<std::uint32_t> next_shared;
    for (const std::uint32_t here : corner.carried) next_shared.push_back(at_level.shared[here]);
    WeightTable columns(corner.shared + corner.own + next_shared.size(), range);
    WeightTable next_star(star_points, range);
    const Range at_vertex = prefix(range, [](const PatchPlace& at) { return at.at_vertex; });
    const Range rest{at_vertex.end, range.end};
    // Places in the order of depth: at the vertex, deeper, then in one outer child after the other.
    const Range deeper = prefix(rest, [&](const PatchPlace& at) { return at.path.level > level; });
    if (deeper.end > deeper.begin) {
      const CornerOperator::Child& inner = corner.children[0];
      const WeightTable made = below_vertex({at_level.star, inner.op, next_shared}, level + 1, deeper);
      for (std::size_t p = 0; p < star_points; ++p) next_star.add(p, 1, made, p);
      columns.add_by_way_of(corner, inner, made, star_points);
    }
    for (Range child{deeper.end, deeper.end}; child.begin < range.end; child.begin = child.end) {
      const std::uint8_t number = place(child.begin).path.child;
      child = prefix({child.begin, range.end}, [&](const PatchPlace& at) { return at.path.child == number; });
      const CornerOperator::Child& made = corner.children[number];
      const WeightTable weights = made.cell_class == CellClass::kLine
                                      ? of_line_ring(made.op, made.layer_points, made.phantoms, child)
                                      : of_patch(3, made.phantoms, child);
      columns.add_by_way_of(corner, made, weights);
    }
    const std::size_t first_next = corner.shared + corner.own;
    for (std::size_t k = 0; k < next_shared.size(); ++k) next_star.add(next_shared[k], 1, columns, first_next + k);
    WeightTable table(star_points + corner.own, range);
    for (std::uint32_t p = 0; p < star_points; ++p) table.add_by_way_of(at_level.star.stencils, p, next_star, p);
    for (std::size_t k = 0; k < corner.shared; ++k) table.add(at_level.shared[k], 1, columns, k);
    for (std::size_t k = 0; k < corner.own; ++k) table.add(star_points + k, 1, columns, corner.shared + k);
    return table;
  }

  /// The four layers of a line (sub-)cell.
  WeightTable of_line_ring(std::uint32_t op, std::size_t layer_points, PhantomMask phantoms, const Range& range) const {
    // A line cell is a planar scheme times a B-spline in w: so are its weights.
    const WeightTable planar = of_planar_ring(op, range);
    WeightTable table(4 * layer_points, range);
    const WeightTable along = basis_along(2, range);
    for (std::size_t layer = 0; layer < 4; ++layer) {
      for (std::size_t p = 0; p < layer_points; ++p) {
        table.set_product(layer * layer_points + p, along.row(layer), planar.row(p));
      }
    }
    for (std::size_t p = 0; p < layer_points; ++p) {
      if (phantoms >> 4 & 1) table.move_phantom(p, p + layer_points, p + 2 * layer_points);
      if (phantoms >> 5 & 1) table.move_phantom(p + 3 * layer_points, p + 2 * layer_points, p + layer_points);
    }
    return table;
  }

  /// One layer of a line (sub-)cell.
  WeightTable of_planar_ring(std::uint32_t op, const Range& range) const {
    WeightTable table = below_line(op, 0, range);
    table.set_columns(prefix(range, [](const PatchPlace& at) { return at.at_line; }),
                      data_.operators.lines()[op].limit);
    return table;
  }

  /// Weights of the layer at a level, at places that lie as deep; zero at the line itself.
  WeightTable below_line(std::uint32_t op, int level, const Range& range) const {
    const PlanarOperator& ring = data_.operators.lines()[op];
    WeightTable table(ring.points, range);
    const Range at_line = prefix(range, [](const PatchPlace& at) { return at.at_line; });
    const Range rest{at_line.end, range.end};
    const Range deeper = prefix(rest, [&](const PatchPlace& at) { return at.path.line_level > level; });
    if (deeper.end > deeper.begin) {
      const ChildRows& next = ring.children[0];
      table.add_by_way_of(ring, next, below_line(next.op, level + 1, deeper));
    }
    for (Range child{deeper.end, deeper.end}; child.begin < range.end; child.begin = child.end) {
      const std::uint8_t number = place(child.begin).path.line_child;
      child = prefix({child.begin, range.end}, [&](const PatchPlace& at) { return at.path.line_child == number; });
      const ChildRows& made = ring.children[number];
      table.add_by_way_of(ring, made, of_patch(2, made.phantoms, child));
    }
    return table;
  }

  /// The patch's own points: 4 along each of `axes` axes.
  WeightTable of_patch(std::size_t axes, PhantomMask phantoms, const Range& range) const {
    WeightTable grid = basis_along(0, range);
    for (std::size_t axis = 1; axis < axes; ++axis) {
      const WeightTable along = basis_along(axis, range);
      const std::size_t count = std::size_t{1} << (2 * axis);
      WeightTable product(4 * count, range);
      for (std::size_t p = 0; p < 4 * count; ++p) product.set_product(p, grid.row(p % count), along.row(p / count));
      grid = std::move(product);
    }
    move_phantoms(grid, axes, phantoms);
    return grid;
  }

  /// Weights of four points along an axis.
  WeightTable basis_along(std::size_t axis, const Range& range) const {
    WeightTable table(4, range);
    for (std::size_t n = range.begin; n < range.end; ++n) {
      std::array<double, 4> basis, unused;
      bspline_basis(place(n).local[static_cast<Eigen::Index>(axis)], basis, unused);
      for (std::size_t p = 0; p < 4; ++p) table.at(p, n) = basis[p];
    }
    return table;
  }

  const LimitSolid::Data& data_;
  std::vector<PatchPlace> places_;    // In the order of depth.
  std::vector<std::size_t> columns_;  // Where each of the places asked for is among them.
};

}  // namespace

LimitStencils::LimitStencils(const LimitSolid::Data& data, const LimitCell& cell, std::span<const Vec3> framed)
    : points_(data.point_count(cell)), strips_((framed.size() + kStencilStrip - 1) / kStencilStrip) {
  const StencilWalk walk(data, cell, framed);
  const WeightTable weights = walk.weights_of(cell);
  weights_.assign(strips_ * points_ * 2, Lanes{});
  for (std::size_t n = 0; n < framed.size(); ++n) {
    const std::size_t column = walk.column(n), strip = n / kStencilStrip, at = n % kStencilStrip;
    Lanes* weight = &weights_[strip * points_ * 2 + at / kLanes];
    for (std::size_t p = 0; p < points_; ++p, weight += 2) (*weight)[at % kLanes] = weights.row(p)[column];
  }
}

}  // namespace ccslice
