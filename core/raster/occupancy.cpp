// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/occupancy.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccslice {
namespace {

/// An edge passes a row of voxel centres: the first `column` centres of the row lie to its left.
struct RowCrossing {
  std::uint32_t column;
  std::int32_t winding;  // +1: the edge goes up in y.
};

/// First index in [0, count] whose centre isn't below `at`, by the centres' own rounding.
std::uint32_t first_centre_from(double at, double origin, double pitch, double pitch_inverse, std::uint32_t count) {
  const double guess = std::floor((at - origin) * pitch_inverse - 0.5);
  auto index = static_cast<std::int64_t>(std::clamp(guess, 0.0, static_cast<double>(count)));
  const auto centre = [=](std::int64_t i) { return origin + (static_cast<double>(i) + 0.5) * pitch; };
  while (index > 0 && centre(index - 1) >= at) --index;
  while (index < count && centre(index) < at) ++index;
  return static_cast<std::uint32_t>(index);
}

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

/// An edge of the contours and the rows of centres that it passes: [begin, end). It owns its lower end.
struct CrossingEdge {
  const Vec2 &low, &high;
  bool up;
  std::uint32_t begin, end;
};

/// Calls visit(edge) for every edge that passes one of the rows, and these.
template <class Visit>
void for_each_edge(const Contours& contours, const LayerLattice& lattice, const RowRange& rows, Visit&& visit) {
  const double rows_per_mm = 1 / lattice.dy_mm;
  const auto row_from = [&](const Vec2& p) {
    const std::uint32_t row = first_centre_from(p.y(), lattice.y0_mm, lattice.dy_mm, rows_per_mm, lattice.height);
    return std::clamp(row, rows.begin, rows.end);
  };
  for (const ContourLoop& loop : contours.loops) {
    if (loop.points.empty()) continue;
    const Vec2* p = &loop.points.back().xy;
    std::uint32_t p_row = row_from(*p);
    for (const ContourPoint& point : loop.points) {
      const Vec2* q = &point.xy;
      const std::uint32_t q_row = row_from(*q);
      if (p_row < q_row) visit(CrossingEdge{*p, *q, true, p_row, q_row});
      if (q_row < p_row) visit(CrossingEdge{*q, *p, false, q_row, p_row});
      p = q;
      p_row = q_row;
    }
  }
}

/// Crossings are sorted by column; the winding number is zero before the first.
void append_spans(std::uint32_t row, std::span<const RowCrossing> crossings, std::vector<VoxelRun>& spans) {
  std::int32_t winding = 0;
  std::uint32_t begin = 0;
  for (std::size_t k = 0; k < crossings.size();) {
    const std::uint32_t column = crossings[k].column;
    const bool was_inside = winding != 0;
    for (; k < crossings.size() && crossings[k].column == column; ++k) winding -= crossings[k].winding;
    if (!was_inside && winding != 0) begin = column;
    if (was_inside && winding == 0 && begin < column) spans.push_back({row, begin, column});
  }
}

}  // namespace

std::vector<VoxelRun> rasterize(const Contours& contours, const LayerLattice& lattice, const RowRange& rows) {
  std::vector<std::size_t> row_begin(lattice.height + std::size_t{2});
  for_each_edge(contours, lattice, rows, [&](const CrossingEdge& edge) {
    for (std::uint32_t row = edge.begin; row < edge.end; ++row) ++row_begin[row + 2];
  });
  for (std::size_t row = 2; row < row_begin.size(); ++row) row_begin[row] += row_begin[row - 1];

  std::vector<RowCrossing> crossings(row_begin.back());
  for_each_edge(contours, lattice, rows, [&](const CrossingEdge& edge) {
    const RisingEdge rising(edge.low, edge.high, lattice);
    for (std::uint32_t row = edge.begin; row < edge.end; ++row) {
      crossings[row_begin[row + 1]++] = {rising.columns_left(row), edge.up ? 1 : -1};
    }
  });

  std::vector<VoxelRun> spans;
  for (std::uint32_t row = 0; row < lattice.height; ++row) {
    const std::span<RowCrossing> in_row(crossings.data() + row_begin[row], crossings.data() + row_begin[row + 1]);
    std::sort(in_row.begin(), in_row.end(),
              [](const RowCrossing& a, const RowCrossing& b) { return a.column < b.column; });
    append_spans(row, in_row, spans);
  }
  return spans;
}

BitImage to_bit_image(std::span<const VoxelRun> spans, std::uint32_t width, std::uint32_t height) {
  BitImage image(width, height);
  for (const VoxelRun& span : spans) {
    std::uint8_t* row = image.bits.data() + std::size_t{image.row_bytes} * span.row;
    const std::uint32_t first = span.begin / 8, last = span.end / 8;
    const auto from_begin = static_cast<std::uint8_t>(0xff >> span.begin % 8);
    const auto before_end = static_cast<std::uint8_t>(~(0xff >> span.end % 8));
    if (first == last) {
      row[first] |= from_begin & before_end;
      continue;
    }
    row[first] |= from_begin;
    std::fill(row + first + 1, row + last, std::uint8_t{0xff});
    if (before_end != 0) row[last] |= before_end;
  }
  return image;
}

}  // namespace ccslice
