// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/region_runs.h"

#include <algorithm>
#include <cstddef>

#include "core/raster/row_crossings.h"

namespace ccslice {
namespace {

/// An edge passes a row of voxel centres: the first `column` centres of the row lie to its left.
struct RegionCrossing {
  std::uint32_t column;
  std::uint8_t left, right;  // The regions there.
};

/// Winding numbers of the regions along a row, from left to right.
class RegionWindings {
 public:
  explicit RegionWindings(std::span<const RegionCrossing> crossings) : crossings_(crossings) {}

  /// The region of a voxel at or to the right of the last one asked for; kNoCellRegion if it is in none.
  std::uint8_t region_at(std::uint32_t column) {
    // Passing an edge leaves the region on its left and enters that on its right.
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
                                    const LayerLattice& lattice, const RowRange& rows,
                                    const CancellationToken& cancel) {
  const RowFinder row_from(lattice, rows);
  auto crossings = crossing_rows<RegionCrossing>(lattice, [&](auto&& visit) {
    for (const RegionEdge& edge : edges) {
      const std::uint32_t from = row_from(edge.from), to = row_from(edge.to);
      // An edge that goes down has its right side towards smaller columns.
      if (from < to) visit(edge.from, edge.to, from, to, RegionCrossing{0, edge.left, edge.right});
      if (to < from) visit(edge.to, edge.from, to, from, RegionCrossing{0, edge.right, edge.left});
    }
  });
  std::vector<RegionRun> runs;
  for (std::size_t k = 0; k < spans.size();) {
    cancel.throw_if_cancelled();
    const std::uint32_t row = spans[k].row;
    RegionWindings windings(crossings.sorted_row(row));
    for (; k < spans.size() && spans[k].row == row; ++k) {
      const std::size_t first = runs.size();
      for (std::uint32_t column = spans[k].begin; column < spans[k].end;) {
        const std::uint8_t region = windings.region_at(column);
        const std::uint32_t end = windings.end(spans[k].end);
        const bool goes_on = runs.size() > first && (region == kNoCellRegion || region == runs.back().region);
        // Voxels that rounding leaves in no region go with those to their left. At a span's begin they wait for those
        // to their right, and get region 0 if none come.
        if (goes_on) {
          runs.back().end = end;
        } else if (runs.size() > first && runs.back().region == kNoCellRegion) {
          runs.back() = {{row, runs.back().begin, end}, region};
        } else {
          runs.push_back({{row, column, end}, region});
        }
        column = end;
      }
      if (runs.back().region == kNoCellRegion) runs.back().region = 0;
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
