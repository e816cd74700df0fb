// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/raster/occupancy.h"

#include <algorithm>

#include "core/raster/row_crossings.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kRowsPerPoll = 64;

/// An edge passes a row of voxel centres: the first `column` centres of the row lie to its left.
struct RowCrossing {
  std::uint32_t column;
  std::int32_t winding;  // +1: the edge goes up in y.
};

/// Calls visit(low, high, begin, end, crossing) for every edge that passes one of the rows (CrossingRows).
template <class Visit>
void for_each_edge(const Contours& contours, const LayerLattice& lattice, const RowRange& rows, Visit&& visit) {
  const RowFinder row_from(lattice, rows);
  for (const ContourLoop& loop : contours.loops) {
    if (loop.points.empty()) continue;
    const Vec2* p = &loop.points.back().xy;
    std::uint32_t p_row = row_from(*p);
    for (const ContourPoint& point : loop.points) {
      const Vec2* q = &point.xy;
      const std::uint32_t q_row = row_from(*q);
      if (p_row < q_row) visit(*p, *q, p_row, q_row, RowCrossing{0, 1});
      if (q_row < p_row) visit(*q, *p, q_row, p_row, RowCrossing{0, -1});
      p = q;
      p_row = q_row;
    }
  }
}

/// Crossings are sorted by column; the winding number is zero before the first. To the left of an edge that goes up it
/// is larger by one than to its right. All crossings of a column count before a span begins or ends there, so that
/// spans are maximal, and edges that run along each other leave none.
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

std::vector<VoxelRun> rasterize(const Contours& contours, const LayerLattice& lattice, const RowRange& rows,
                                const CancellationToken& cancel) {
  auto crossings =
      crossing_rows<RowCrossing>(lattice, [&](auto&& visit) { for_each_edge(contours, lattice, rows, visit); });
  std::vector<VoxelRun> spans;
  for (std::uint32_t row = 0; row < lattice.height; ++row) {
    if (row % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    append_spans(row, crossings.sorted_row(row), spans);
  }
  return spans;
}

BitImage to_bit_image(std::span<const VoxelRun> spans, std::uint32_t width, std::uint32_t height) {
  BitImage image;
  draw_bits(spans, width, height, image);
  return image;
}

void draw_bits(std::span<const VoxelRun> spans, std::uint32_t width, std::uint32_t height, BitImage& image) {
  image.clear(width, height);
  for (const VoxelRun& span : spans) {
    std::uint8_t* row = image.bits.data() + std::size_t{image.row_bytes} * span.row;
    const std::uint32_t first = span.begin / 8, last = span.end / 8;
    // The first voxel of a byte is its highest bit.
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
}

}  // namespace ccslice
