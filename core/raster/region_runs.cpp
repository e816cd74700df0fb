// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/region_runs.h"

#include <algorithm>
#include <cstddef>

#include "core/raster/row_crossings.h"

namespace ccslice {
namespace {

/// The first `column` centres of a row lie to the left of an edge.
struct RegionCrossing {
  std::uint32_t column;
  std::uint8_t left, right;  // The regions there.
};

/// Crossings of all rows, by row.
class CrossingRows {
 public:
  CrossingRows(std::span<const RegionEdge> edges, const LayerLattice& lattice, const RowRange& rows)
      : row_begin_(lattice.height + std::size_t{2}) {
    const RowFinder row_from(lattice, rows);
    const auto for_each_edge = [&](auto visit) {
      for (const RegionEdge& edge : edges) {
        const std::uint32_t from = row_from(edge.from), to = row_from(edge.to);
        if (from < to) visit(edge, from, to);
        if (to < from) visit(RegionEdge{edge.to, edge.from, edge.right, edge.left}, to, from);
      }
    };
    for_each_edge([&](const RegionEdge&, std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t row = begin; row < end; ++row) ++row_begin_[row + 2];
    });
    for (std::size_t row = 2; row < row_begin_.size(); ++row) row_begin_[row] += row_begin_[row - 1];
    crossings_.resize(row_begin_.back());
    for_each_edge([&](const RegionEdge& edge, std::uint32_t begin, std::uint32_t end) {
      const RisingEdge rising(edge.from, edge.to, lattice);
      for (std::uint32_t row = begin; row < end; ++row) {
        crossings_[row_begin_[row + 1]++] = {rising.columns_left(row), edge.left, edge.right};
      }
    });
  }

  /// By column.
  std::span<const RegionCrossing> row(std::uint32_t row) {
    const std::span<RegionCrossing> in_row(crossings_.data() + row_begin_[row],
                                           crossings_.data() + row_begin_[row + 1]);
    std::ranges::sort(in_row, {}, &RegionCrossing::column);
    return in_row;
  }

 private:
  std::vector<std::size_t> row_begin_;
  std::vector<RegionCrossing> crossings_;
};

/// Winding numbers of the regions along a row, from left to right.
class RegionWindings {
 public:
  explicit RegionWindings(std::span<const RegionCrossing> crossings) : crossings_(crossings) {}

  /// The region of a voxel at or to the right of the last one asked for; kNoCellRegion if it is in none.
  std::uint8_t region_at(std::uint32_t column) {
    for (; !crossings_.empty() && crossings_.front().column <= column; crossings_ = crossings_.subspan(1)) {
      add(crossings_.front().left, -1);
      add(crossings_.front().right, 1);
    }
    std::uint8_t lowest = kNoCellRegion;
    for (const auto& [region, number] : windings_) {
      if (number != 0) lowest = std::min(lowest, region);
    }
    return lowest;
  }
  /// The voxels from the last one asked for up to this one, at least, are of the same region.
  std::uint32_t end(std::uint32_t most) const {
    return crossings_.empty() ? most : std::min(most, crossings_.front().column);
  }

 private:
  struct Winding {
    std::uint8_t region;
    std::int32_t number;
  };

  void add(std::uint8_t region, std::int32_t number) {
    if (region == kNoCellRegion) return;
    const auto known = std::ranges::find(windings_, region, &Winding::region);
    if (known == windings_.end()) {
      windings_.push_back({region, number});
    } else {
      known->number += number;
    }
  }

  std::span<const RegionCrossing> crossings_;
  std::vector<Winding> windings_;  // Of the regions met so far.
};

}  // namespace

std::vector<RegionRun> find_regions(std::span<const RegionEdge> edges, std::span<const VoxelRun> spans,
                                    const LayerLattice& lattice, const RowRange& rows) {
  CrossingRows crossings(edges, lattice, rows);
  std::vector<RegionRun> runs;
  for (std::size_t k = 0; k < spans.size();) {
    const std::uint32_t row = spans[k].row;
    RegionWindings windings(crossings.row(row));
    for (; k < spans.size() && spans[k].row == row; ++k) {
      const std::size_t first = runs.size();
      for (std::uint32_t column = spans[k].begin; column < spans[k].end;) {
        const std::uint8_t region = windings.region_at(column);
        const std::uint32_t end = windings.end(spans[k].end);
        const bool goes_on = runs.size() > first && (region == kNoCellRegion || region == runs.back().region);
        if (goes_on) {
          runs.back().end = end;
        } else if (runs.size() > first && runs.back().region == kNoCellRegion) {
          runs.back() = {{row, runs.back().begin, end}, region};
        } else {
          runs.push_back({{row, column, end}, region});
        }
        column = end;
      }
    }
  }
  return runs;
}

void draw_regions(std::span<const RegionRun> runs, const LayerWindow& window, std::vector<std::uint8_t>& numbers) {
  numbers.assign(std::size_t{window.columns} * window.rows, 0);
  for (const RegionRun& run : runs) {
    const VoxelRun part = window.clipped(run);
    if (part.begin >= part.end) continue;
    std::fill_n(numbers.data() + window.index(part.begin, part.row), part.end - part.begin,
                static_cast<std::uint8_t>(run.region + 1));
  }
}

}  // namespace ccslice
