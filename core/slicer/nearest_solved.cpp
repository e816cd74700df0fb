// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/nearest_solved.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace ccslice {

NearestSolved::NearestSolved(std::span<const Span> inside, std::span<const Span> unresolved,
                             const LayerLattice& lattice)
    : dx_mm_(lattice.dx_mm), dy_mm_(lattice.dy_mm), height_(lattice.height), row_begin_(lattice.height + 1, 0) {
  auto hole = unresolved.begin();
  for (const Span& span : inside) {
    std::uint32_t begin = span.begin;
    for (; hole != unresolved.end() && hole->y == span.y && hole->begin < span.end; ++hole) {
      if (begin < hole->begin) runs_.push_back({span.y, begin, hole->begin});
      begin = hole->end;
    }
    if (begin < span.end) runs_.push_back({span.y, begin, span.end});
  }
  for (const Span& run : runs_) ++row_begin_[run.y + 1];
  for (std::size_t y = 0; y < height_; ++y) row_begin_[y + 1] += row_begin_[y];
}

std::optional<std::uint32_t> NearestSolved::nearest_column(std::uint32_t x, std::uint32_t y) const noexcept {
  const auto begin = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[y]);
  const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[y + 1]);
  const auto right = std::partition_point(begin, end, [x](const Span& run) { return run.end <= x; });
  std::optional<std::uint32_t> best;
  if (right != begin) best = std::prev(right)->end - 1;
  if (right != end) {
    const std::uint32_t column = std::max(right->begin, x);
    if (!best || column - x < x - *best) best = column;
  }
  return best;
}

NearestSolved::Voxel NearestSolved::nearest(std::uint32_t x, std::uint32_t y) const noexcept {
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
  for (std::uint32_t step = 0; step < height_; ++step) {
    const double dy_mm = dy_mm_ * step;
    if (dy_mm * dy_mm > best_distance2) break;
    if (step <= y) try_row(y - step, dy_mm);
    if (step > 0 && step < height_ - y) try_row(y + step, dy_mm);
  }
  return best;
}

}  // namespace ccslice
