// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/line_residuals.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/limit/patch.h"

namespace ccslice {
namespace {

using Matrix = Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Row = Eigen::RowVectorXd;
using Place = Eigen::Array2d;
/// A number for each degree of Bernstein polynomials, or for each node along an axis.
using AlongNodes = Eigen::Matrix<double, kBlockNodes, 1>;
using OnNodes = Eigen::Matrix<double, kBlockNodes, kBlockNodes>;

constexpr Eigen::Index kPlanarNodes = kBlockNodes * kBlockNodes, kSquares = kBlockIntervals * kBlockIntervals;
constexpr int kLevelsBelowSquares = 18, kMostLevels = 48;  // What is left then is small beside what came before.
constexpr double kSmallPart = 0.2;                         // Of a square.
constexpr double kNothing = 1e-9;                          // Of the largest residual, where cross approximation ends,
constexpr double kRounding = 1e-13;                        // or in all.

/// Lagrange's polynomials of degree 4, at equidistant nodes from 0 to 1.
AlongNodes lagrange(double at) {
  AlongNodes weights;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    weights[i] = 1;
    for (Eigen::Index k = 0; k < weights.size(); ++k) {
      if (k != i) weights[i] *= (4 * at - static_cast<double>(k)) / static_cast<double>(i - k);
    }
  }
  return weights;
}

/// Values at the nodes -> Bernstein coefficients, along both axes.
OnNodes to_bernstein(const OnNodes& values) {
  static const OnNodes kOfValues = [] {
    OnNodes matrix;
    matrix << 36, 0, 0, 0, 0,     //
        -39, 144, -108, 48, -9,   //
        26, -128, 240, -128, 26,  //
        -9, 48, -108, 144, -39,   //
        0, 0, 0, 0, 36;
    return OnNodes(matrix / 36);
  }();
  return kOfValues * values * kOfValues.transpose();
}

/// Between the nodes (i, k) and (i + 1, k + 1), as number i + 4 k.
Rectangle square_of(const Rectangle& box, Eigen::Index square) {
  const Place size = (box.high - box.low) / kBlockIntervals;
  const Place at(static_cast<double>(square % kBlockIntervals), static_cast<double>(square / kBlockIntervals));
  return {box.low + size * at, box.low + size * (at + 1)};
}

/// A planar scheme's patches down to some level: what the ring's points weigh in them.
class PlanarNest {
 public:
  PlanarNest(const OperatorTable& operators, std::uint32_t op, int levels) : limit_(operators.lines()[op].limit) {
    const Eigen::Index points = static_cast<Eigen::Index>(limit_.size());
    const auto dimension = static_cast<std::size_t>(points);
    ring_ = RowMajor::Identity(points, points);
    for (int level = 0; level < levels; ++level) {
      const PlanarOperator& now = operators.lines()[op];
      for (std::size_t child = 1; child < 4; ++child) {
        RowMajor& patch = patches_.emplace_back(16, points);
        now.stencils.apply(now.rows_of(now.children[child]), ring_.data(), dimension, patch.data());
        fill_phantoms(patch.data(), 2, dimension, now.children[child].phantoms);
      }
      const ChildRows& next = now.children[0];
      RowMajor ring(next.count, points);
      now.stencils.apply(now.rows_of(next), ring_.data(), dimension, ring.data());
      ring_.swap(ring);
      op = next.op;
    }
  }

  static Rectangle patch(int level, std::size_t child) {
    const Place low(child & 1 ? 0.5 : 0, child & 2 ? 0.5 : 0);
    return {std::ldexp(1.0, -level) * low, std::ldexp(1.0, -level) * (low + 0.5)};
  }
  /// What each of the ring's points weighs at places in a patch, its sides included.
  Matrix weights(int level, std::size_t child, std::span<const Place> places) const {
    Matrix basis(static_cast<Eigen::Index>(places.size()), 16);
    for (std::size_t n = 0; n < places.size(); ++n) {
      const Place local = std::ldexp(1.0, level) * 2 * places[n] - Place(child & 1 ? 1 : 0, child & 2 ? 1 : 0);
      std::array<double, 4> u, v, unused;
      bspline_basis(local[0], u, unused);
      bspline_basis(local[1], v, unused);
      for (std::size_t p = 0; p < 16; ++p) {
        basis(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(p)) = u[p % 4] * v[p / 4];
      }
    }
    return basis * patches_[3 * static_cast<std::size_t>(level) + child - 1];
  }
  /// Anywhere. REQUIRES: it is on the line or no deeper than the patches.
  Row weights(const Place& at) const {
    const double largest = at.maxCoeff();
    if (largest <= 0) return Row::Map(limit_.data(), static_cast<Eigen::Index>(limit_.size()));
    const int level = largest >= 0.5 ? 0 : -std::ilogb(largest) - 1;
    const Place half = std::ldexp(1.0, -level - 1) * Place::Ones();
    const std::size_t child = (at[0] >= half[0] ? 1u : 0u) + (at[1] >= half[1] ? 2u : 0u);
    return weights(level, child, {&at, 1});
  }
  /// The points of the ring at the level that is beyond the patches.
  const RowMajor& ring() const { return ring_; }

 private:
  const std::vector<double>& limit_;
  std::vector<RowMajor> patches_;  // By level, by child.
  RowMajor ring_;
};

/// What each of the ring's points weighs at a rectangle's nodes.
Matrix weights_at_nodes(const PlanarNest& nest, const Rectangle& box, Eigen::Index points) {
  Matrix weights(kPlanarNodes, points);
  for (Eigen::Index n = 0; n < kPlanarNodes; ++n) weights.row(n) = nest.weights(box.node(n));
  return weights;
}

using NodePlaces = std::array<Place, kPlanarNodes>;
NodePlaces nodes_of(const Rectangle& box) {
  NodePlaces nodes;
  for (Eigen::Index n = 0; n < kPlanarNodes; ++n) nodes[static_cast<std::size_t>(n)] = box.node(n);
  return nodes;
}

/// What a rectangle's nodes weigh in its interpolation at those of another one.
Matrix interpolation(const Rectangle& box, const Rectangle& other) {
  OnNodes u, v;
  for (Eigen::Index n = 0; n < u.rows(); ++n) {
    const Place share = (other.node(n * (kBlockNodes + 1)) - box.low) / (box.high - box.low);
    u.row(n) = lagrange(share[0]);
    v.row(n) = lagrange(share[1]);
  }
  Matrix weights(kPlanarNodes, kPlanarNodes);
  for (Eigen::Index k = 0; k < v.rows(); ++k) {
    for (Eigen::Index m = 0; m < v.cols(); ++m) {
      weights.block<kBlockNodes, kBlockNodes>(kBlockNodes * k, kBlockNodes * m) = v(k, m) * u;
    }
  }
  return weights;
}

/// Residuals of the ring's points at the nodes of all patches' parts of squares.
class ResidualTable {
 public:
  /// 25 rows each.
  struct PatchPart {
    Eigen::Index square, first_row;
    Rectangle box;
  };

  ResidualTable(const PlanarNest& nest, const Rectangle& box, int levels, const Matrix& at_nodes) {
    std::vector<Matrix> residuals;
    for (int level = 0; level < levels; ++level) {
      for (std::size_t child = 1; child < 4; ++child) {
        const Rectangle patch = PlanarNest::patch(level, child);
        if (patch.intersection(box).is_empty()) continue;
        for (Eigen::Index square = 0; square < kSquares; ++square) {
          const Rectangle part = patch.intersection(square_of(box, square));
          if (part.is_empty()) continue;
          parts_.push_back({square, kPlanarNodes * static_cast<Eigen::Index>(residuals.size()), part});
          residuals.push_back(nest.weights(level, child, nodes_of(part)) - interpolation(box, part) * at_nodes);
        }
      }
    }
    table_.resize(kPlanarNodes * static_cast<Eigen::Index>(residuals.size()), at_nodes.cols());
    for (std::size_t p = 0; p < parts_.size(); ++p) table_.middleRows<kPlanarNodes>(parts_[p].first_row) = residuals[p];
  }

  const Matrix& table() const { return table_; }
  const std::vector<PatchPart>& parts() const { return parts_; }

 private:
  Matrix table_;
  std::vector<PatchPart> parts_;
};

/// Rows and columns whose product with the inverse of where they cross is the whole table.
struct Cross {
  std::vector<Eigen::Index> rows, columns;
};

/// Takes off the product of the column and the row of the largest entry, divided by it, again and again. Each step
/// leaves zeros in that row and column, so there are no more than the table's rank.
Cross cross_of(Matrix table) {
  Cross cross;
  double first = 0;
  while (table.size() > 0) {
    Eigen::Index r = 0, c = 0;
    const double pivot = table.cwiseAbs().maxCoeff(&r, &c);
    first = std::max(first, pivot);
    if (!(pivot > std::max(kRounding, kNothing * first))) break;
    cross.rows.push_back(r);
    cross.columns.push_back(c);
    const Eigen::VectorXd column = table.col(c);
    const Row row = table.row(r) / table(r, c);
    table.noalias() -= column * row;
  }
  return cross;
}

/// A bound of |f - I f| where patches are ever smaller: f in the hull of `points`, I f by its nodes.
double most_in_rest(const Eigen::VectorXd& points, const Eigen::VectorXd& at_nodes, const Rectangle& box,
                    const Rectangle& rest) {
  const Eigen::VectorXd interpolated = interpolation(box, rest) * at_nodes;
  const OnNodes bernstein = to_bernstein(OnNodes::Map(interpolated.data()));
  return std::max(points.maxCoeff() - bernstein.minCoeff(), bernstein.maxCoeff() - points.minCoeff());
}

/// The cubic that four layers make along a line: the weights of its Bezier coefficients between two parameters. The
/// b-th is the cubic's blossom at 3 - b times `from` and b times `to`: means of products of one, two or three of these
/// stand for t, t^2 and t^3 in the B-spline's basis.
std::array<Lanes, 4> bezier_weights(double from, double to) {
  std::array<Lanes, 4> weights{};
  for (std::size_t b = 0; b < 4; ++b) {
    std::array<double, 3> t;  // Its blossom at these.
    for (std::size_t k = 0; k < 3; ++k) t[k] = k < b ? to : from;
    const double linear = (t[0] + t[1] + t[2]) / 3, square = (t[0] * t[1] + t[0] * t[2] + t[1] * t[2]) / 3,
                 cube = t[0] * t[1] * t[2];
    weights[0][b] = (1 - 3 * linear + 3 * square - cube) / 6;
    weights[1][b] = (4 - 6 * square + 3 * cube) / 6;
    weights[2][b] = (1 + 3 * linear + 3 * square - 3 * cube) / 6;
    weights[3][b] = cube / 6;
  }
  return weights;
}

}  // namespace

std::optional<LineBox> find_line_box(const LimitSolid::Data& data, LimitCellId cell, const ParamBox& box) {
  const LimitCell& limit_cell = data.cells[cell];
  if (limit_cell.cell_class == CellClass::kRegular) return std::nullopt;
  const PatchPlace place = find_patch(data, limit_cell, 0.5 * (box.low + box.high));
  if (place.at_vertex || place.at_line || place.path.line_child == 0) return std::nullopt;
  LineBox result;
  result.path = place.path;
  const double scale = std::ldexp(0.5, -place.path.line_level);  // Of the patch, along u and v.
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    result.axis[i] = place.axis[i];
    result.mirrored[i] = place.factor[a] < 0;
    const double size = a < 2 ? scale : 1, child = a < 2 ? place.path.line_child >> a & 1 : 0;
    const double middle = size * (place.local[a] + child);
    const double half = 0.5 * size * std::abs(place.factor[a]) * (box.high - box.low)[place.axis[i]];
    result.low[a] = middle - half;
    result.high[a] = middle + half;
  }
  if (!(result.low.minCoeff() >= 0 && result.high.maxCoeff() <= 1)) return std::nullopt;
  const bool at_vertex = limit_cell.cell_class == CellClass::kVertex;
  result.op = at_vertex ? sub_cell_of(data, limit_cell, place.path).op : limit_cell.op;
  return result;
}

/// The residuals' table T has a row for each node of each patch's part of a square, where residuals have degree 4 and
/// so are known by their nodes, and a column for each of the ring's points. With rows R and columns C of the cross,
/// T = T(:, C) T(R, C)^-1 T(R, :): the last factor makes the r_j of the points, the others are the a_j at the nodes.
PlanarResiduals::PlanarResiduals(const OperatorTable& operators, std::uint32_t op, const Rectangle& box) {
  const int levels = kLevelsBelowSquares - std::ilogb((box.high - box.low).minCoeff() / kBlockIntervals);
  const Rectangle rest{Place::Zero(), Place::Constant(std::ldexp(1.0, -levels))};
  const bool at_line = (box.low == 0).all();
  if (levels > kMostLevels || (!at_line && !rest.intersection(box).is_empty())) return;
  known_ = true;
  const PlanarNest nest(operators, op, levels);
  const Matrix at_nodes = weights_at_nodes(nest, box, nest.ring().cols());
  const ResidualTable residuals(nest, box, levels, at_nodes);
  const Cross cross = cross_of(residuals.table());
  rows_ = residuals.table()(cross.rows, Eigen::all);
  if (cross.rows.empty()) return;
  const Matrix inverse = rows_(Eigen::all, cross.columns).inverse();
  const Matrix values = residuals.table()(Eigen::all, cross.columns) * inverse;
  std::vector<double> most(count());
  for (const ResidualTable::PatchPart& part : residuals.parts()) {
    for (std::size_t j = 0; j < most.size(); ++j) {
      const Eigen::VectorXd nodes = values.col(static_cast<Eigen::Index>(j)).segment(part.first_row, kPlanarNodes);
      most[j] = to_bernstein(OnNodes::Map(nodes.data())).cwiseAbs().maxCoeff();
    }
    add_part(part.square, square_of(box, part.square), part.box, most);
  }
  // a_j itself is a residual: of column j of T(R, C)^-1 as the points C, and 0 for all others. So hulls bound it where
  // patches end.
  if (!at_line) return;
  const Matrix points = nest.ring()(Eigen::all, cross.columns) * inverse;
  const Matrix of_nodes = at_nodes(Eigen::all, cross.columns) * inverse;
  for (std::size_t j = 0; j < most.size(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    most[j] = most_in_rest(points.col(column), of_nodes.col(column), box, rest);
  }
  add_part(0, square_of(box, 0), rest, most);
}

/// Small ones of a square become one.
void PlanarResiduals::add_part(Eigen::Index square, const Rectangle& whole, const Rectangle& part,
                               const std::vector<double>& most) {
  const Place size = whole.high - whole.low, low = (part.low - whole.low) / size, high = (part.high - whole.low) / size;
  const auto i = static_cast<std::size_t>(square % kBlockIntervals),
             k = static_cast<std::size_t>(square / kBlockIntervals);
  const auto is_small = [](const Place& from, const Place& to) { return (to - from).maxCoeff() < kSmallPart; };
  const auto same =
      std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return p.i == i && p.k == k && p.small; });
  if (!is_small(low, high)) {
    parts_.push_back({i, k, low, high, most, false});
  } else if (same == parts_.end()) {
    parts_.push_back({i, k, low, high, most, true});
  } else {
    same->low = same->low.min(low);
    same->high = same->high.max(high);
    for (std::size_t j = 0; j < most.size(); ++j) same->most[j] = std::max(same->most[j], most[j]);
  }
}

std::size_t PlanarResiduals::memory_bytes() const noexcept {
  return sizeof(*this) + static_cast<std::size_t>(rows_.size()) * sizeof(double) +
         parts_.size() * (sizeof(Part) + count() * sizeof(double));
}

LineResiduals::LineResiduals(const LimitSolid::Data& data, std::vector<std::uint32_t> channels, std::size_t most_bytes)
    : data_(data), channels_(std::move(channels)), builder_(data, data.dimension), most_bytes_(most_bytes) {}

bool LineResiduals::find(LimitCellId cell, const ParamBox& box, BlockResiduals& residuals) {
  const std::optional<LineBox> line_box = find_line_box(data_, cell, box);
  if (!line_box) return false;
  const Known& of_box = known(*line_box);
  if (!of_box.planar->known()) return false;
  residuals.box = *line_box;
  residuals.planar = of_box.planar;
  const std::span<const double> layers = builder_.line_layers(data_.cells[cell], line_box->path);
  const std::size_t points = layers.size() / 4 / data_.dimension, count = of_box.planar->count();
  std::array<std::array<Lanes, 4>, kBlockIntervals> weights;
  for (std::size_t n = 0; n < kBlockIntervals; ++n) {
    const double size = (line_box->high.z() - line_box->low.z()) / kBlockIntervals;
    weights[n] = bezier_weights(line_box->low.z() + static_cast<double>(n) * size,
                                line_box->low.z() + static_cast<double>(n + 1) * size);
  }
  const auto put = [&](std::size_t number, std::vector<BlockResiduals::AlongLine>& out) {
    out.assign(count, {});
    for (std::size_t j = 0; j < count; ++j) {
      for (std::size_t layer = 0; layer < 4; ++layer) {
        double residual = 0;
        const double* point = layers.data() + layer * points * data_.dimension + number;
        for (std::size_t p = 0; p < points; ++p, point += data_.dimension) {
          residual += of_box.rows(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(p)) * *point;
        }
        for (std::size_t n = 0; n < kBlockIntervals; ++n) {
          out[j][n] = multiply_add(weights[n][layer], residual, out[j][n]);
        }
      }
    }
  };
  for (std::size_t a = 0; a < 3; ++a) put(a, residuals.position[a]);
  residuals.values.resize(channels_.size());
  for (std::size_t c = 0; c < channels_.size(); ++c) put(3 + channels_[c], residuals.values[c]);
  return true;
}

/// The residuals of a box that lies in half of the cell at the line are those of the child that it fills, by way of its
/// ring.
const LineResiduals::Known& LineResiduals::known(const LineBox& box) {
  const Key key(box.op, {box.low.x(), box.low.y(), box.high.x(), box.high.y()});
  if (const auto found = known_.find(key); found != known_.end()) return found->second;
  Rectangle part{box.low.head<2>(), box.high.head<2>()};
  std::uint32_t op = box.op;
  const auto points = static_cast<Eigen::Index>(data_.operators.lines()[op].points);
  RowMajor ring = RowMajor::Identity(points, points);
  // The child over [0, 1/2]^2 has parameters twice as large, and its ring follows from this one by one step.
  for (; part.high.maxCoeff() <= 0.5; part.low *= 2, part.high *= 2) {
    const PlanarOperator& now = data_.operators.lines()[op];
    RowMajor next(now.children[0].count, points);
    now.stencils.apply(now.rows_of(now.children[0]), ring.data(), static_cast<std::size_t>(points), next.data());
    ring.swap(next);
    op = now.children[0].op;
  }
  Known made{planar(op, part), {}};
  if (made.planar->known()) made.rows = made.planar->rows() * ring;
  forget_beyond_most(sizeof(Known) + static_cast<std::size_t>(made.rows.size()) * sizeof(double));
  return known_.emplace(key, std::move(made)).first->second;
}

std::shared_ptr<const PlanarResiduals> LineResiduals::planar(std::uint32_t op, const Rectangle& box) {
  const Key key(op, {box.low.x(), box.low.y(), box.high.x(), box.high.y()});
  if (const auto found = planar_.find(key); found != planar_.end()) return found->second;
  auto made = std::make_shared<const PlanarResiduals>(data_.operators, op, box);
  forget_beyond_most(made->memory_bytes());
  return planar_.emplace(key, std::move(made)).first->second;
}

void LineResiduals::forget_beyond_most(std::size_t bytes) {
  bytes_ += bytes;
  if (bytes_ <= most_bytes_) return;
  known_.clear();
  planar_.clear();
  bytes_ = bytes;
}

}  // namespace ccslice
