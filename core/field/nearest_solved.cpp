// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/nearest_solved.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace ccslice {

NearestSolved::NearestSolved(std::span<const VoxelRun> inside, std::span<const VoxelRun> unresolved,
                             const LayerLattice& lattice, std::uint64_t most_rows)
    : dx_mm_(lattice.dx_mm),
      dy_mm_(lattice.dy_mm),
      height_(lattice.height),
      row_begin_(lattice.height + 1, 0),
      rows_left_(most_rows) {
  auto hole = unresolved.begin();
  for (const VoxelRun& span : inside) {
    std::uint32_t begin = span.begin;
    for (; hole != unresolved.end() && hole->row == span.row && hole->begin < span.end; ++hole) {
      if (begin < hole->begin) runs_.push_back({span.row, begin, hole->begin});
      begin = hole->end;
    }
    if (begin < span.end) runs_.push_back({span.row, begin, span.end});
  }
  for (const VoxelRun& run : runs_) ++row_begin_[run.row + 1];
  for (std::size_t y = 0; y < height_; ++y) row_begin_[y + 1] += row_begin_[y];
  if (!runs_.empty()) find_nearest_rows();
}

void NearestSolved::find_nearest_rows() {
  nearest_row_.resize(height_);
  std::uint32_t below = runs_.front().row;  // The first rows have none below them.
  auto above = runs_.begin();
  for (std::uint32_t y = 0; y < height_; ++y) {
    while (above != runs_.end() && above->row < y) below = (above++)->row;
    const bool take_above = above != runs_.end() && (below > y || above->row - y < y - below);
    nearest_row_[y] = take_above ? above->row : below;
  }
}

std::optional<std::uint32_t> NearestSolved::nearest_column(std::uint32_t x, std::uint32_t y) const noexcept {
  const auto begin = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[y]);
  const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[y + 1]);
  const auto right = std::partition_point(begin, end, [x](const VoxelRun& run) { return run.end <= x; });
  std::optional<std::uint32_t> best;
  if (right != begin) best = std::prev(right)->end - 1;
  if (right != end) {
    const std::uint32_t column = std::max(right->begin, x);
    if (!best || column - x < x - *best) best = column;
  }
  return best;
}

NearestSolved::Voxel NearestSolved::nearest(std::uint32_t x, std::uint32_t y) noexcept {
  Voxel best{0, 0};
  double best_distance2 = std::numeric_limits<double>::infinity();
  const auto try_row = [&](std::uint32_t row, double dy_mm) {
    const std::optional<std::uint32_t> column = nearest_column(x, row);
    if (!column) return;
    const double dx_mm = dx_mm_ * (static_cast<double>(*column) - x);
    const double distance2 = dx_mm * dx_mm + dy_mm * dy_mm;
    if (std::tie(distance2, row) < std::tie(best_distance2, best.y)) {
      best_distance2 = distance2;
      best = {*column, row};
    }
  };
  const std::uint32_t first_row = nearest_row_[y];
  const std::uint32_t first_step = first_row > y ? first_row - y : y - first_row;
  for (std::uint32_t step = first_step; step < height_; ++step) {
    const double dy_mm = dy_mm_ * step;
    if (dy_mm * dy_mm > best_distance2) break;
    if (step > first_step && rows_left_ == 0) break;
    rows_left_ -= rows_left_ > 0;
    if (step <= y) try_row(y - step, dy_mm);
    if (step > 0 && step < height_ - y) try_row(y + step, dy_mm);
  }
  return best;
}

}  // namespace ccslice
