// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/bezier_cells.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <unordered_map>
#include <utility>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/patch_path.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice {
namespace {

/// Points nearer than this share of the box's diagonal are one. Far above what rounding does, far below any cell.
constexpr double kSamePoint = 1e-9;

/// Gives points at the same place, to rounding, the same number. Cells of a lattice that is coarse beside rounding and
/// fine beside the mesh; a point near a wall of its cell may have been entered beyond the wall.
class PointMerger {
 public:
  explicit PointMerger(const Box3& box) : origin_(box.min()), cell_(kSamePoint * box.diagonal().norm()) {}

  /// The number of a point there, of the same region; `next` if there is none yet.
  std::uint32_t number_at(const Vec3& point, std::uint8_t region, std::uint32_t next) {
    constexpr double kNear = 0.25;  // Of a lattice cell.
    const Vec3 place = (point - origin_) / cell_;
    std::array<std::array<std::int64_t, 2>, 3> sides{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = place[static_cast<Eigen::Index>(axis)];
      sides[axis] = {std::llround(std::floor(at - kNear)), std::llround(std::floor(at + kNear))};
    }
    for (std::size_t i = 0; i < 8; ++i) {
      const auto found = numbers_.find({sides[0][i & 1], sides[1][i >> 1 & 1], sides[2][i >> 2], region});
      if (found != numbers_.end()) return found->second;
    }
    const auto own = [&](int axis) { return std::llround(std::floor(place[axis])); };
    numbers_.emplace(Key{own(0), own(1), own(2), region}, next);
    return next;
  }

 private:
  using Key = std::array<std::int64_t, 4>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::int64_t part : key)
        hash = (hash ^ static_cast<std::uint64_t>(part)) * 0x9e3779b97f4a7c15 >> 7 ^ hash << 11;
      return hash;
    }
  };
  Vec3 origin_;
  double cell_;
  std::unordered_map<Key, std::uint32_t, Hash> numbers_;
};

/// Values at 0, 1/3, 2/3 and 1 -> Bezier points, of rows of `dimension` doubles, `stride` rows from each other.
void values_to_bezier(double* values, std::size_t stride, std::size_t dimension) {
  for (std::size_t d = 0; d < dimension; ++d) {
    double* const f = values + d;
    const std::size_t step = stride * dimension;
    const double f0 = f[0], f1 = f[step], f2 = f[2 * step], f3 = f[3 * step];
    f[step] = (-5 * f0 + 18 * f1 - 9 * f2 + 2 * f3) / 6;
    f[2 * step] = (2 * f0 - 9 * f1 + 18 * f2 - 5 * f3) / 6;
  }
}

/// A box of a cell's parameters.
struct ParamBox {
  Vec3 low = Vec3::Zero();
  Vec3 size = Vec3::Ones();

  Vec3 at(double u, double v, double w) const { return low + size.cwiseProduct(Vec3(u, v, w)); }
};

class BezierBuilder {
 public:
  BezierBuilder(const LimitSolid& solid, int levels)
      : solid_(solid),
        levels_(levels),
        evaluator_(solid),
        dimension_(3 + solid.channel_count()),
        merger_(solid.summary().bounding_box) {}

  void add(LimitCellId cell) { add(cell, ParamBox{}, levels_); }
  BezierCells take() { return std::move(cells_); }

 private:
  /// Patches are boxes of dyadic numbers, as boxes here are: one that holds eight points of a box holds all of it.
  bool is_one_patch(LimitCellId cell, const ParamBox& box) const {
    constexpr double kInset = 1.0 / 1024;
    const LimitCell& limit_cell = solid_.data().cells[cell];
    std::uint32_t path = 0;
    for (int i = 0; i < 8; ++i) {
      const auto side = [&](int axis) { return (i >> axis & 1) != 0 ? 1 - kInset : kInset; };
      const PatchPlace place = find_patch(solid_.data(), limit_cell, box.at(side(0), side(1), side(2)));
      if (place.at_line || place.at_vertex) return false;
      if (i > 0 && place.path.packed() != path) return false;
      path = place.path.packed();
    }
    return true;
  }

  void add(LimitCellId cell, const ParamBox& box, int levels) {
    if (is_one_patch(cell, box)) return add_cell(cell, box, 3);
    if (levels == 0) return add_cell(cell, box, 1);
    cut(cell, box, levels - 1);
  }

  /// Along the line of a line cell nothing is cut: its patches are as long as the cell.
  void cut(LimitCellId cell, const ParamBox& box, int levels) {
    const LimitCell& limit_cell = solid_.data().cells[cell];
    const int whole = limit_cell.cell_class == CellClass::kLine ? limit_cell.frame.axis[2] : -1;
    Vec3 size = box.size / 2;
    if (whole >= 0) size[whole] = box.size[whole];
    for (int i = 0; i < 8; ++i) {
      if (whole >= 0 && (i >> whole & 1) != 0) continue;
      add(cell, {box.at(0.5 * (i & 1), 0.5 * (i >> 1 & 1), 0.5 * (i >> 2)), size}, levels);
    }
  }

  void add_cell(LimitCellId cell, const ParamBox& box, std::uint8_t order) {
    if (cells_.cell_orders.size() == kMostBezierCells) {
      throw Error(ErrorCode::kMeshTooLarge, "the limit takes more than " + std::to_string(kMostBezierCells) +
                                                " Bezier cells; cut irregular cells less often");
    }
    const std::size_t side = order + 1u;
    rows_.resize(side * side * side * dimension_);
    double* row = rows_.data();
    for (std::size_t i = 0; i < side * side * side; ++i, row += dimension_) {
      const auto along = [&](std::size_t number) { return static_cast<double>(number) / order; };
      const Vec3 uvw = box.at(along(i % side), along(i / side % side), along(i / side / side));
      Vec3::Map(row) = evaluator_.geo_and_mat({cell, uvw}, std::span(row + 3, dimension_ - 3));
    }
    if (order == 3) interpolate();
    const std::uint8_t region = solid_.region_of(solid_.control_cell(cell));
    for (const double* point = rows_.data(); point != row; point += dimension_) add_point(point, region);
    cells_.cell_orders.push_back(order);
    cells_.control_cells.push_back(static_cast<std::uint32_t>(solid_.control_cell(cell)));
    if (solid_.has_several_regions()) cells_.cell_regions.push_back(region);
  }

  void interpolate() {
    for (std::size_t i = 0; i < 16; ++i) {
      values_to_bezier(&rows_[4 * i * dimension_], 1, dimension_);
    }
    for (std::size_t i = 0; i < 16; ++i) values_to_bezier(&rows_[(i % 4 + 16 * (i / 4)) * dimension_], 4, dimension_);
    for (std::size_t i = 0; i < 16; ++i) values_to_bezier(&rows_[i * dimension_], 16, dimension_);
  }

  void add_point(const double* row, std::uint8_t region) {
    const Vec3 position = Vec3::Map(row);
    const auto next = static_cast<std::uint32_t>(cells_.points.size());
    const std::uint32_t number = merger_.number_at(position, region, next);
    cells_.cell_points.push_back(number);
    if (number != next) return;
    cells_.points.push_back(position);
    for (std::size_t c = 3; c < dimension_; ++c) cells_.channel_values.push_back(static_cast<float>(row[c]));
  }

  const LimitSolid& solid_;
  const int levels_;
  LimitEvaluator evaluator_;
  const std::size_t dimension_;  // Of a row: a position, then channels.
  PointMerger merger_;
  std::vector<double> rows_;
  BezierCells cells_;
};

}  // namespace

BezierCells bezier_cells(const LimitSolid& solid, int levels, const CancellationToken& cancel) {
  BezierBuilder builder(solid, levels);
  for (const LimitCellId cell : solid.cells()) {
    cancel.throw_if_cancelled();
    builder.add(cell);
  }
  return builder.take();
}

BezierCells bezier_cells(ControlMesh mesh, int levels, const PrepareOptions& options) {
  return bezier_cells(*prepare_solid(std::move(mesh), options), levels, options.cancel);
}

}  // namespace ccslice
