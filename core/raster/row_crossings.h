// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where edges of contours pass rows of voxel centres, which scan conversion is made of. Each edge owns its lower end. A
// centre exactly on an edge is to its right. So edges that share ends to the last bit leave no gap.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/raster/occupancy.h"

namespace ccslice {

/// First index in [0, count] whose centre isn't below `at`, by the centres' own rounding.
inline std::uint32_t first_centre_from(double at, double origin, double pitch, double pitch_inverse,
                                       std::uint32_t count) {
  const double guess = std::floor((at - origin) * pitch_inverse - 0.5);
  auto index = static_cast<std::int64_t>(std::clamp(guess, 0.0, static_cast<double>(count)));
  const auto centre = [=](std::int64_t i) { return origin + (static_cast<double>(i) + 0.5) * pitch; };
  while (index > 0 && centre(index - 1) >= at) --index;
  while (index < count && centre(index) < at) ++index;
  return static_cast<std::uint32_t>(index);
}

/// The first of `rows` whose centres aren't below a point.
class RowFinder {
 public:
  RowFinder(const LayerLattice& lattice, const RowRange& rows)
      : lattice_(lattice), rows_(rows), rows_per_mm_(1 / lattice.dy_mm) {}

  std::uint32_t operator()(const Vec2& p) const {
    const std::uint32_t row = first_centre_from(p.y(), lattice_.y0_mm, lattice_.dy_mm, rows_per_mm_, lattice_.height);
    return std::clamp(row, rows_.begin, rows_.end);
  }

 private:
  const LayerLattice& lattice_;
  RowRange rows_;
  double rows_per_mm_;
};

/// The edge from `low` to `high` (in y) as the scan conversion sees it. REQUIRES: low.y() < high.y().
class RisingEdge {
 public:
  RisingEdge(const Vec2& low, const Vec2& high, const LayerLattice& lattice)
      : low_(low),
        dx_(high.x() - low.x()),
        dy_(high.y() - low.y()),
        columns_per_mm_(1 / lattice.dx_mm),
        lattice_(lattice) {}

  /// How many centres of row y lie strictly to the left: those with (high - low) x (centre - low) > 0.
  std::uint32_t columns_left(std::uint32_t row) const {
    const double y = lattice_.y0_mm + (row + 0.5) * lattice_.dy_mm - low_.y();
    const double along = dx_ * y;
    const auto is_left = [&](std::int64_t i) {
      const double x = lattice_.x0_mm + (static_cast<double>(i) + 0.5) * lattice_.dx_mm - low_.x();
      return along - x * dy_ > 0;
    };
    const double guess = std::floor((low_.x() + along / dy_ - lattice_.x0_mm) * columns_per_mm_ + 0.5);
    auto columns = static_cast<std::int64_t>(std::clamp(guess, 0.0, static_cast<double>(lattice_.width)));
    while (columns > 0 && !is_left(columns - 1)) --columns;
    while (columns < lattice_.width && is_left(columns)) ++columns;
    return static_cast<std::uint32_t>(columns);
  }

 private:
  Vec2 low_;
  double dx_, dy_;
  double columns_per_mm_;
  const LayerLattice& lattice_;
};

/// Crossings of edges with rows, sorted into their rows. A Crossing has a `column`: so many centres of the row lie to
/// the edge's left.
template <class Crossing>
class CrossingRows {
 public:
  /// for_each_edge(visit) calls visit(low, high, begin, end, crossing) for each edge that passes rows [begin, end), in
  /// the same order each time: from `low` to `high` in y, with a crossing that lacks its column.
  template <class ForEachEdge>
  CrossingRows(const LayerLattice& lattice, ForEachEdge&& for_each_edge) : row_begin_(lattice.height + std::size_t{2}) {
    for_each_edge([&](const Vec2&, const Vec2&, std::uint32_t begin, std::uint32_t end, const Crossing&) {
      for (std::uint32_t row = begin; row < end; ++row) ++row_begin_[row + 2];
    });
    for (std::size_t row = 2; row < row_begin_.size(); ++row) row_begin_[row] += row_begin_[row - 1];
    crossings_.resize(row_begin_.back());
    for_each_edge([&](const Vec2& low, const Vec2& high, std::uint32_t begin, std::uint32_t end, Crossing crossing) {
      const RisingEdge rising(low, high, lattice);
      for (std::uint32_t row = begin; row < end; ++row) {
        crossing.column = rising.columns_left(row);
        crossings_[row_begin_[row + 1]++] = crossing;
      }
    });
  }

  /// Those of a row, by column.
  std::span<const Crossing> sorted_row(std::uint32_t row) {
    const std::span<Crossing> in_row(crossings_.data() + row_begin_[row], crossings_.data() + row_begin_[row + 1]);
    std::sort(in_row.begin(), in_row.end(), [](const Crossing& a, const Crossing& b) { return a.column < b.column; });
    return in_row;
  }

 private:
  std::vector<std::size_t> row_begin_;  // Row r begins at [r] once all crossings are there.
  std::vector<Crossing> crossings_;
};

}  // namespace ccslice
