// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/unfolded_proof.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>

#include "core/limit/patch_path.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {
namespace {

// As a share of how far a ring's points are. An average of n points is off by n * 6e-8 at most: of some thirty at each
// of up to seven levels, and of what makes a net of them.
constexpr float kFloatsLose = 2e-5F;
constexpr float kFarthest = 1e4F;  // A point of the ring, in the cell's parameters, or it isn't looked at.
constexpr std::uint64_t kNotTried = ~std::uint64_t{0};

using Row = Id<struct RowKind>;

/// Writes the chosen rows of the points.
template <typename Rows>
void apply(const PackedStencils& stencils, const Rows& chosen, const PointLanes* points, PointLanes* out) noexcept {
  for (const std::uint32_t row : chosen) {
    PointLanes sum{};
    stencils.for_each(row, [&](std::uint32_t column, double weight) {
      sum = multiply_add(points[column], static_cast<float>(weight), sum);
    });
    *out++ = sum;
  }
}

/// All rows of four layers of points: out[4 * r + layer], from points[4 * p + layer].
void apply_to_layers(const PackedStencils& stencils, const PointLanes* points, PointLanes* out) noexcept {
  for (std::uint32_t row = 0; row < stencils.rows(); ++row, out += 4) {
    for (std::size_t layer = 0; layer < 4; ++layer) {
      PointLanes sum{};
      stencils.for_each(row, [&](std::uint32_t column, double weight) {
        sum = multiply_add(points[4 * column + layer], static_cast<float>(weight), sum);
      });
      out[layer] = sum;
    }
  }
}

}  // namespace

UnfoldedProof::UnfoldedProof(const LimitSolid::Data& data, LineFolds& lines, const VertexFolds& vertices,
                             const Levels& levels)
    : data_(data), lines_(lines), vertices_(vertices), levels_(levels) {
  std::size_t columns = 64, rows = 64;
  for (const CornerOperator& op : data_.operators.corners()) {
    columns = std::max<std::size_t>(columns, op.shared + op.own + op.carried.size());
    rows = std::max<std::size_t>(rows, op.stencils.rows());
  }
  columns_.resize(columns);
  next_columns_.resize(columns);
  made_.resize(rows);
  layers_.resize(data_.operators.max_ring_points());
  made_layers_.resize(data_.operators.max_ring_points());
}

/// Class, operator and phantom layers, or kNotTried.
std::uint64_t UnfoldedProof::kind_of(const LimitCell& cell) const {
  std::uint32_t op = 0;
  if (cell.cell_class == CellClass::kLine) {
    op = cell.op;
    if (lines_.is_sharp(op)) return kNotTried;
  } else if (cell.cell_class == CellClass::kVertex) {
    op = data_.operators.vertices()[cell.op].corner;
    if (vertices_.has_sharp_edge(data_.operators.corners()[op])) return kNotTried;
  }
  return std::uint64_t{op} << 16 | static_cast<std::uint64_t>(cell.cell_class) << 8 | cell.phantoms;
}

void UnfoldedProof::examine(std::span<const LimitCellId> cells, const PrepareOptions& options,
                            std::span<std::uint8_t> proved) {
  step_stars(cells);
  order_.clear();
  for (const LimitCellId c : cells) {
    const std::uint64_t kind = kind_of(data_.cells[c]);
    if (kind != kNotTried) order_.emplace_back(kind, c);
  }
  std::ranges::sort(order_);
  std::array<LimitCellId, kFloatLanes> batch;
  for (std::size_t begin = 0, end = 0; begin < order_.size(); begin = end) {
    options.cancel.throw_if_cancelled();
    for (; end < order_.size() && end < begin + kFloatLanes && order_[end].first == order_[begin].first; ++end) {
      batch[end - begin] = order_[end].second;
    }
    const unsigned lanes = prove(Batch(batch).first(end - begin)) & ((1u << (end - begin)) - 1);
    for (std::size_t n = 0; n < end - begin; ++n) proved[batch[n]] = lanes >> n & 1;
    options.count(static_cast<std::uint64_t>(std::popcount(lanes)));
  }
}

/// Each star that cells have in common is stepped once.
void UnfoldedProof::step_stars(std::span<const LimitCellId> cells) {
  std::vector<std::pair<std::uint32_t, LimitCellId>> found;
  for (const LimitCellId c : cells) {
    if (data_.cells[c].cell_class == CellClass::kVertex) found.emplace_back(data_.cells[c].star_begin, c);
  }
  std::ranges::sort(found);
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  stars_.clear();
  std::size_t size = 0;
  const auto levels = static_cast<std::size_t>(levels_.beside_vertex) + 2;
  for (const auto& [ring_begin, c] : found) {
    stars_.push_back({ring_begin, size});
    size += levels * data_.star(data_.cells[c]).size();
  }
  star_points_ = std::vector<StarPoint>(size);
  StarPoint* out = star_points_.data();
  for (const auto& [ring_begin, c] : found) out = step_star(data_.cells[c], levels, out);
}

UnfoldedProof::StarPoint* UnfoldedProof::step_star(const LimitCell& cell, std::size_t levels, StarPoint* out) {
  const PackedStencils& step = data_.operators.stars()[data_.operators.vertices()[cell.op].star].stencils;
  const auto star = data_.star(cell);
  const Lanes origin = to_lanes(data_.position(star[0]));
  star_.resize(star.size() * kLanes);
  next_star_.resize(star_.size());
  for (std::size_t p = 0; p < star.size(); ++p) {
    store_unaligned(to_lanes(data_.position(star[p])) - origin, &star_[kLanes * p]);
  }
  for (std::size_t level = 0; level < levels; ++level) {
    for (std::size_t i = 0; i < star_.size(); i += kLanes, ++out) {
      for (std::size_t a = 0; a < 3; ++a) (*out)[a] = static_cast<float>(star_[i + a]);
    }
    step.apply(0, step.rows(), star_.data(), kLanes, next_star_.data());
    star_.swap(next_star_);
  }
  return out;
}

std::span<const UnfoldedProof::StarPoint> UnfoldedProof::star_points(const LimitCell& cell, int level) const {
  const auto star = std::ranges::lower_bound(stars_, cell.star_begin, {}, &StarLevels::ring_begin);
  const std::size_t size = data_.star(cell).size();
  return std::span(star_points_).subspan(star->begin + static_cast<std::size_t>(level) * size, size);
}

unsigned UnfoldedProof::prove(Batch batch) {
  switch (data_.cells[batch[0]].cell_class) {
    case CellClass::kRegular: return prove_regular(batch);
    case CellClass::kLine: return prove_line(batch);
    default: return prove_vertex(batch);
  }
}

/// About a control point of each cell, by the Jacobian in its middle: a mirrored one would hide that the cell is.
template <typename Origin>
void UnfoldedProof::set_views(Batch batch, Origin origin) {
  views_.fill({});  // Whose zeros prove nothing.
  for (std::size_t n = 0; n < batch.size(); ++n) {
    const Mat3 map = data_.cell_maps[batch[n]].inverse_jacobian;
    if (map.determinant() > 0) views_[n] = {to_lanes(data_.position(origin(n))), LaneMap(map)};
  }
}

void UnfoldedProof::see(std::size_t lane, Lanes offset, PointLanes& out) const {
  const Lanes seen = views_[lane].map(offset);
  out.x[lane] = static_cast<float>(seen[0]);
  out.y[lane] = static_cast<float>(seen[1]);
  out.z[lane] = static_cast<float>(seen[2]);
}

template <typename Index>
void UnfoldedProof::load_rings(Batch batch, std::size_t count, Index index, PointLanes* out) {
  for (std::size_t n = 0; n < batch.size(); ++n) {
    const CellRing ring = data_.ring(data_.cells[batch[n]]);
    for (std::size_t p = 0; p < count; ++p) {
      const std::uint32_t point = ring[index(p)];
      see(n, point == kNone ? Lanes{} : to_lanes(data_.position(point)) - views_[n].origin, out[p]);
    }
  }
}

void UnfoldedProof::set_slack(std::span<const PointLanes> points) {
  BoxLanes box;
  for (const PointLanes& p : points) box.extend(p);
  const FloatLanes x = greater(-box.low.x, box.high.x), y = greater(-box.low.y, box.high.y);
  const FloatLanes farthest = greater(greater(x, y), greater(-box.low.z, box.high.z));
  slack_ = farthest < kFarthest ? kFloatsLose * farthest : BoxLanes::kHuge;
}

unsigned UnfoldedProof::prove_regular(Batch batch) {
  set_views(batch, [&](std::size_t n) { return data_.ring(data_.cells[batch[n]])[21]; });
  load_rings(batch, 64, std::identity(), made_.data());
  set_slack(std::span(made_).first(64));
  return prove_net(std::span(made_).first(64), data_.cells[batch[0]].phantoms);
}

unsigned UnfoldedProof::prove_net(std::span<PointLanes> grid, PhantomMask phantoms) const {
  fill_phantoms(grid, phantoms);
  bspline_to_bezier(grid);
  std::array<BoxLanes, 3> columns;
  extend_by_differences(grid, columns);
  for (BoxLanes& box : columns) box.grow(2 * slack_);
  return proper_lanes(columns);
}

/// In the middle alone, which shows what all of it is like.
unsigned UnfoldedProof::prove_middle(std::span<PointLanes> grid, PhantomMask phantoms) const {
  fill_phantoms(grid, phantoms);
  std::array<double, 4> value, slope;
  bspline_basis(0.5, value, slope);
  std::array<PointLanes, 3> sums{};
  for (std::size_t p = 0; p < 64; ++p) {
    const std::array<std::size_t, 3> at = {p & 3, p >> 2 & 3, p >> 4};
    for (std::size_t a = 0; a < 3; ++a) {
      const double weight = slope[at[a]] * value[at[(a + 1) % 3]] * value[at[(a + 2) % 3]];
      sums[a] = multiply_add(grid[p], static_cast<float>(weight), sums[a]);
    }
  }
  std::array<BoxLanes, 3> columns;
  for (std::size_t a = 0; a < 3; ++a) {
    columns[a].extend(sums[a]);
    columns[a].grow(2 * slack_);
  }
  return proper_lanes(columns);
}

unsigned UnfoldedProof::prove_line(Batch batch) {
  const LimitCell& first = data_.cells[batch[0]];
  const std::size_t count = data_.operators.lines()[first.op].points;
  set_views(batch, [&](std::size_t n) { return data_.ring(data_.cells[batch[n]])[count]; });
  const auto by_layers = [&](std::size_t p) { return p % 4 * count + p / 4; };
  load_rings(batch, 4 * count, by_layers, layers_.data());
  set_slack(std::span(layers_).first(4 * count));
  return prove_line(first.op, first.phantoms, levels_.line);
}

unsigned UnfoldedProof::prove_line(std::uint32_t op, PhantomMask phantoms, int levels) {
  const std::vector<PlanarOperator>& lines = data_.operators.lines();
  const std::size_t points = lines[op].points;
  for (std::size_t p = 0; p < 4 * points; p += 4) {  // Planar stencils act on each layer alike.
    const std::span line = std::span(layers_).subspan(p, 4);
    fill_phantoms(line, static_cast<PhantomMask>(phantoms >> 4));
    bspline_to_bezier(line);
  }
  unsigned proved = ~0u;
  for (int level = 0; level < levels; ++level) {
    const PlanarOperator& line = lines[op];
    proved &= prove_line_level(line);
    if (proved == 0) return 0;
    PointLanes* out = layers_.data();
    for (const std::uint32_t row : line.rows_of(line.children[0])) {
      out = std::copy_n(&made_layers_[std::size_t{4} * row], 4, out);
    }
    op = line.children[0].op;
  }
  return proved & prove_beside_line(op);
}

/// One box for the three patches of a level.
unsigned UnfoldedProof::prove_line_level(const PlanarOperator& line) {
  apply_to_layers(line.stencils, layers_.data(), made_layers_.data());
  std::array<BoxLanes, 3> columns;
  std::array<PointLanes, 64> net;
  for (std::size_t c = 1; c < 4; ++c) {
    const auto rows = line.rows_of(line.children[c]);
    for (std::size_t layer = 0; layer < 4; ++layer) {
      const std::span plane = std::span(net).subspan(16 * layer, 16);
      for (std::size_t p = 0; p < 16; ++p) plane[p] = made_layers_[4 * rows[p] + layer];
      fill_phantoms(plane, line.children[c].phantoms);
      bspline_to_bezier(plane);
    }
    extend_by_differences(net, columns);
  }
  for (BoxLanes& box : columns) box.grow(2 * slack_);
  return proper_lanes(columns);
}

/// d/du and d/dv beside the line, of each view, and d/dw on it. Beside a smooth boundary what grows with the level may
/// be most of both: the shorter one, as often as that helps, is taken off the other, which leaves the determinant.
unsigned UnfoldedProof::prove_beside_line(std::uint32_t op) {
  const Eigen::MatrixXd& weights = lines_.weights_of(op);
  const std::array<PointLanes, 4> position = line_curve(weights.col(0));
  std::array<BoxLanes, 3> columns;
  for (std::size_t i = 0; i < 3; ++i) columns[2].extend(position[i + 1] - position[i]);
  columns[2].grow(2 * slack_);
  const auto box_of = [&](const Eigen::VectorXd& slope) {
    BoxLanes box;
    for (const PointLanes& p : line_curve(slope)) box.extend(p);
    box.grow(static_cast<float>(slope.lpNorm<1>()) * slack_);
    return box;
  };
  unsigned proved = ~0u;
  for (Eigen::Index view = 1; view < weights.cols(); view += 2) {
    Eigen::VectorXd u = weights.col(view), v = weights.col(view + 1);
    if (view > 1) {
      Eigen::VectorXd& longer = u.squaredNorm() > v.squaredNorm() ? u : v;
      const Eigen::VectorXd& shorter = &longer == &u ? v : u;
      longer -= longer.dot(shorter) / shorter.squaredNorm() * shorter;
    }
    columns[0] = box_of(u);
    columns[1] = box_of(v);
    proved &= proper_lanes(columns);
  }
  return proved;
}

/// A curve along the line, of weights in the points of a layer.
std::array<PointLanes, 4> UnfoldedProof::line_curve(const Eigen::VectorXd& weights) const {
  std::array<PointLanes, 4> sum{};
  const PointLanes* point = layers_.data();
  for (const double weight : weights) {
    for (PointLanes& layer : sum) layer = multiply_add(*point++, static_cast<float>(weight), layer);
  }
  return sum;
}

unsigned UnfoldedProof::prove_vertex(Batch batch) {
  std::uint32_t op = data_.operators.vertices()[data_.cells[batch[0]].op].corner;
  const std::vector<CornerOperator>& corners = data_.operators.corners();
  for (std::size_t n = 0; n < batch.size(); ++n)
    shared_[n] = data_.operators.vertices()[data_.cells[batch[n]].op].shared;
  set_views(batch, [&](std::size_t n) { return data_.star(data_.cells[batch[n]])[0]; });
  load_shared(batch, 0, columns_.data());
  load_rings(batch, corners[op].own, std::identity(), &columns_[corners[op].shared]);
  set_slack(std::span(columns_).first(corners[op].shared + corners[op].own));
  add_slack_of_stars(batch);
  unsigned proved = ~0u;
  for (int level = 0;; ++level) {
    const CornerOperator& corner = corners[op];
    load_next_shared(batch, corner, level + 1);
    if (level < levels_.vertex) {
      apply(corner.stencils, IdRange<Row>(corner.stencils.rows()), columns_.data(), made_.data());
      proved &= prove_children(corner);
    } else if (level == levels_.beside_vertex) {
      const CornerOperator::Child& last = corner.children[7];
      apply(corner.stencils, corner.rows_of(last), columns_.data(), made_.data());
      return proved & prove_middle(std::span(made_).first(64), last.phantoms);
    }
    if (proved == 0) return 0;
    descend(corner, level < levels_.vertex);
    op = corner.children[0].op;
  }
}

unsigned UnfoldedProof::prove_children(const CornerOperator& corner) {
  unsigned proved = ~0u;
  std::array<PointLanes, 64> grid;
  for (std::size_t c = 1; c < 8 && proved != 0; ++c) {
    const CornerOperator::Child& child = corner.children[c];
    const auto rows = corner.rows_of(child);
    if (child.cell_class == CellClass::kRegular) {
      for (std::size_t p = 0; p < 64; ++p) grid[p] = made_[rows[p]];
      proved &= prove_net(grid, child.phantoms);
      continue;
    }
    for (std::size_t layer = 0; layer < 4; ++layer) {
      for (std::size_t p = 0; p < child.layer_points; ++p)
        layers_[4 * p + layer] = made_[rows[layer * child.layer_points + p]];
    }
    proved &= prove_line(child.op, child.phantoms, levels_.sub_line);
  }
  return proved;
}

void UnfoldedProof::load_shared(Batch batch, int level, PointLanes* out) {
  for (std::size_t n = 0; n < batch.size(); ++n) {
    const auto points = star_points(data_.cells[batch[n]], level);
    for (std::size_t k = 0; k < shared_[n].size(); ++k) {
      const auto& [x, y, z] = points[shared_[n][k]];
      see(n, Lanes{x, y, z, 0}, out[k]);
    }
  }
}

/// The star's points became floats before they were seen, by a map that may stretch what that lost.
void UnfoldedProof::add_slack_of_stars(Batch batch) {
  for (std::size_t n = 0; n < batch.size(); ++n) {
    float farthest = 0;
    for (const StarPoint& p : star_points(data_.cells[batch[n]], 0)) {
      farthest = std::max({farthest, std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
    }
    const double stretch = data_.cell_maps[batch[n]].inverse_jacobian.cwiseAbs().rowwise().sum().maxCoeff();
    slack_[n] += std::numeric_limits<float>::epsilon() * static_cast<float>(stretch) * farthest;
  }
}

/// Goes on to the next level's shared points, and leaves columns_ as the corner operator wants them.
void UnfoldedProof::load_next_shared(Batch batch, const CornerOperator& corner, int level) {
  for (std::size_t n = 0; n < batch.size(); ++n) {
    next_shared_.clear();
    for (const std::uint32_t here : corner.carried) next_shared_.push_back(shared_[n][here]);
    shared_[n].swap(next_shared_);
  }
  load_shared(batch, level, &columns_[corner.shared + corner.own]);
}

/// `made`: all rows are in made_.
void UnfoldedProof::descend(const CornerOperator& corner, bool made) {
  const auto rows = corner.rows_of(corner.children[0]);
  PointLanes* out = std::copy_n(&columns_[corner.shared + corner.own], corner.carried.size(), next_columns_.data());
  if (made) {
    for (const std::uint32_t row : rows) *out++ = made_[row];
  } else {
    apply(corner.stencils, rows, columns_.data(), out);
  }
  columns_.swap(next_columns_);
}

}  // namespace ccslice
