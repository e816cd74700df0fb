// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_raster.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/interpolation/pieces/block_faces.h"

namespace ccslice {
namespace {

/// The first index in [low, high] that isn't below `at`, or high.
std::uint32_t first_from(double at, std::uint32_t low, std::uint32_t high) {
  return static_cast<std::uint32_t>(std::ceil(std::clamp(at, static_cast<double>(low), static_cast<double>(high))));
}

}  // namespace

void BlockRaster::scan(const BlockPoints& points, std::size_t step, const ScanBounds& bounds,
                       std::vector<BlockRun>& runs) {
  load(points, bounds);
  if (first_layer_ >= end_layer_ || first_row_ >= end_row_) return;
  const std::size_t count = std::size_t{end_row_ - first_row_} * (end_layer_ - first_layer_);
  if (rows_.size() < count) rows_.resize(count);
  for (std::size_t r = 0; r < count; ++r) rows_[r].count = 0;
  for (std::size_t side = 0; side < 6; ++side) scan_face(side / 2, side % 2, step);
  Row* row = rows_.data();
  for (std::uint32_t layer = first_layer_; layer < end_layer_; ++layer) {
    for (std::uint32_t y = first_row_; y < end_row_; ++y) append_runs(*row++, layer, y, bounds.columns, runs);
  }
}

void BlockRaster::load(const BlockPoints& points, const ScanBounds& bounds) {
  Box3 box;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3& p = points[n];
    box.extend(p);
    nodes_[n] = {p.x(), p.y(), p.z(), first_from(p.z(), bounds.first_layer, bounds.end_layer)};
  }
  first_layer_ = first_from(box.min().z(), bounds.first_layer, bounds.end_layer);
  end_layer_ = first_from(box.max().z(), bounds.first_layer, bounds.end_layer);
  first_row_ = first_from(box.min().y(), 0, bounds.rows);
  end_row_ = first_from(box.max().y(), 0, bounds.rows);
}

/// Each quadrilateral by its shorter diagonal: blocks that share it choose alike, unless both diagonals are as long and
/// their axes differ.
void BlockRaster::scan_face(std::size_t axis, std::size_t side, std::size_t step) {
  const BlockFace face(axis, side);
  for_each_quad(step, [&](std::size_t s, std::size_t t) {
    const Node &a = nodes_[face.node(s, t)], &b = nodes_[face.node(s + step, t)], &c = nodes_[face.node(s, t + step)],
               &d = nodes_[face.node(s + step, t + step)];
    if (a.layer == b.layer && a.layer == c.layer && a.layer == d.layer) return;
    const auto squared = [](const Node& p, const Node& q) {
      return (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y) + (p.z - q.z) * (p.z - q.z);
    };
    const bool a_to_d = squared(a, d) <= squared(b, c);
    scan_triangle(a, b, a_to_d ? d : c);
    scan_triangle(a_to_d ? a : b, d, c);
  });
}

/// Edges are followed from their lower end, whichever triangle they belong to. So triangles that share one find the
/// same crossings, to the last bit, and leave neither a gap nor an overlap.
void BlockRaster::scan_triangle(const Node& a, const Node& b, const Node& c) {
  if (a.layer == b.layer && b.layer == c.layer) return;
  const Node *low = &a, *middle = &b, *high = &c;
  if (middle->z < low->z) std::swap(low, middle);
  if (high->z < middle->z) std::swap(middle, high);
  if (middle->z < low->z) std::swap(low, middle);
  cross_layers(*low, *high, *low, *middle);
  cross_layers(*low, *high, *middle, *high);
}

/// The layers between `from` and `to` cross a triangle's edge between them and its longest one. Four at a time: most
/// crossings lie between the same two rows, and to find that out is all there is to do.
void BlockRaster::cross_layers(const Node& low, const Node& high, const Node& from, const Node& to) {
  if (from.layer >= to.layer) return;
  const double of_long = 1 / (high.z - low.z), of_short = 1 / (to.z - from.z);
  for (std::uint32_t layer = from.layer; layer < to.layer; layer += kLanes) {
    const Lanes at = Lanes{0, 1, 2, 3} + static_cast<double>(layer);
    const Lanes s = (at - low.z) * of_long, t = (at - from.z) * of_short;
    const Lanes long_y = low.y + s * (high.y - low.y), long_x = low.x + s * (high.x - low.x);
    const Lanes short_y = from.y + t * (to.y - from.y), short_x = from.x + t * (to.x - from.x);
    // A layer cuts the triangle in a segment. It crosses the rows from the first that isn't below its lower end to the
    // first that isn't below its upper one: neighbours share ends, so that each row is crossed an even number of times.
    const auto is_turned = short_y < long_y;
    Segments segments;
    segments.y = is_turned ? short_y : long_y;
    segments.x = is_turned ? short_x : long_x;
    const Lanes end_y = is_turned ? long_y : short_y, end_x = is_turned ? long_x : short_x;
    segments.begin = first_rows(segments.y);
    segments.end = first_rows(end_y);
    segments.slope = (end_x - segments.x) / (end_y - segments.y);
    const unsigned crossing = lanes_of(segments.begin < segments.end);
    for (std::uint32_t lane = 0; crossing >> lane != 0 && layer + lane < to.layer; ++lane) {
      if (crossing >> lane & 1) cross_rows(layer + lane, segments, lane);
    }
  }
}

/// The first of the block's rows that aren't below.
Lanes BlockRaster::first_rows(Lanes y) const {
  const Lanes least = Lanes{} + static_cast<double>(first_row_), most = Lanes{} + static_cast<double>(end_row_);
  y = y < least ? least : y;
  return round_up(most < y ? most : y);
}

void BlockRaster::cross_rows(std::uint32_t layer, const Segments& segments, std::uint32_t lane) {
  const auto begin = static_cast<std::uint32_t>(segments.begin[lane]),
             end = static_cast<std::uint32_t>(segments.end[lane]);
  const double y0 = segments.y[lane], x0 = segments.x[lane], slope = segments.slope[lane];
  Row* row = &rows_[std::size_t{layer - first_layer_} * (end_row_ - first_row_) + (begin - first_row_)];
  for (std::uint32_t y = begin; y < end; ++y, ++row) {
    if (row->count < kMostCrossings) row->columns[row->count] = x0 + (y - y0) * slope;
    ++row->count;
  }
}

void BlockRaster::append_runs(Row& row, std::uint32_t layer, std::uint32_t y, std::uint32_t columns,
                              std::vector<BlockRun>& runs) {
  // A row with more crossings than are kept gets no run of this block. Its voxels there count as a gap.
  if (row.count == 0 || row.count > kMostCrossings) return;
  if (row.count == 2) {  // Nearly always.
    if (row.columns[1] < row.columns[0]) std::swap(row.columns[0], row.columns[1]);
  } else {
    std::sort(row.columns.begin(), row.columns.begin() + row.count);
  }
  for (std::size_t k = 0; k + 1 < row.count; k += 2) {
    const double low = row.columns[k], high = row.columns[k + 1];
    const std::uint32_t begin = first_from(low, 0, columns), end = first_from(high, 0, columns);
    if (begin >= end) continue;
    runs.push_back({{y, begin, end}, layer, static_cast<float>(begin - low), static_cast<float>(high - (end - 1.0))});
  }
}

}  // namespace ccslice
