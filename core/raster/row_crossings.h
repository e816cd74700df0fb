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
#include <utility>
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
/// the edge's left. Tall edges pass tens of thousands of rows each, so crossings are held for a BAND of rows at a time:
/// a million of them, or a few times as many as there are edges.
///
/// for_each_edge(visit) calls visit(low, high, begin, end, crossing) for each edge that passes rows [begin, end), in
/// the same order each time: from `low` to `high` in y, with a crossing that lacks its column.
template <class Crossing, class ForEachEdge>
class CrossingRows {
 public:
  /// REQUIRES: the lattice outlives this.
  CrossingRows(const LayerLattice& lattice, ForEachEdge for_each_edge)
      : lattice_(lattice), for_each_edge_(std::move(for_each_edge)), row_begin_(lattice.height + std::size_t{3}) {
    std::size_t edges = 0;
    for_each_edge_([&](const Vec2&, const Vec2&, std::uint32_t begin, std::uint32_t end, const Crossing&) {
      ++edges;
      ++row_begin_[std::size_t{begin} + 2];
      --row_begin_[std::size_t{end} + 2];  // Differences: what comes before is larger.
    });
    std::size_t in_row = 0;
    for (std::size_t row = 2; row < row_begin_.size(); ++row) {
      in_row += row_begin_[row];
      row_begin_[row] = row_begin_[row - 1] + in_row;
    }
    most_in_band_ = std::max(kMostInBand, kMostPerEdge * edges);
    crossings_.reserve(std::min(most_in_band_, row_begin_.back()));
  }

  /// The crossings of a row, by column. REQUIRES: rows ascend from call to call.
  std::span<const Crossing> sorted_row(std::uint32_t row) {
    if (row >= band_end_) fill_band(row);
    Crossing* const band = crossings_.data();
    const std::span<Crossing> in_row(band + (row_begin_[row] - first_), band + (row_begin_[row + 1] - first_));
    std::sort(in_row.begin(), in_row.end(), [](const Crossing& a, const Crossing& b) { return a.column < b.column; });
    return in_row;
  }

 private:
  static constexpr std::size_t kMostInBand = 1 << 20, kMostPerEdge = 4;

  void fill_band(std::uint32_t first_row) {
    first_ = row_begin_[std::size_t{first_row} + 1];
    row_begin_[first_row] = first_;  // If rows before were left out.
    std::uint32_t end_row = first_row + 1;
    while (end_row < lattice_.height && row_begin_[std::size_t{end_row} + 2] - first_ <= most_in_band_) ++end_row;
    crossings_.resize(row_begin_[std::size_t{end_row} + 1] - first_);
    for_each_edge_([&](const Vec2& low, const Vec2& high, std::uint32_t begin, std::uint32_t end, Crossing crossing) {
      const RisingEdge rising(low, high, lattice_);
      const std::uint32_t end_in_band = std::min(end, end_row);
      for (std::uint32_t row = std::max(begin, first_row); row < end_in_band; ++row) {
        crossing.column = rising.columns_left(row);
        crossings_[row_begin_[row + 1]++ - first_] = crossing;
      }
    });
    band_end_ = end_row;
  }

  const LayerLattice& lattice_;
  ForEachEdge for_each_edge_;
  // Of all crossings, by row: row r begins at [r] up to the end of the last band, and at [r + 1] beyond it.
  std::vector<std::size_t> row_begin_;
  std::size_t most_in_band_ = 0;
  std::uint32_t band_end_ = 0;
  std::size_t first_ = 0;            // Where the band begins among all crossings.
  std::vector<Crossing> crossings_;  // Of the band.
};

template <class Crossing, class ForEachEdge>
CrossingRows<Crossing, ForEachEdge> crossing_rows(const LayerLattice& lattice, ForEachEdge for_each_edge) {
  return {lattice, std::move(for_each_edge)};
}

}  // namespace ccslice
