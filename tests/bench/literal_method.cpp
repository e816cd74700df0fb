// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/literal_method.h"

#include <algorithm>

#include "tests/bench/clocks.h"

namespace ccslice::bench {

LiteralCost& LiteralCost::operator+=(const LiteralCost& other) {
  winding_ns += other.winding_ns;
  material_ns += other.material_ns;
  rows += other.rows;
  voxels += other.voxels;
  full += other.full;
  not_found += other.not_found;
  disagreeing += other.disagreeing;
  return *this;
}

LiteralMethod::LiteralMethod(const PrinterJob& job)
    : job_(job),
      lattice_(job.job.grid.lattice()),
      solid_(*job.solid, oracle::cell_boxes(*job.solid)),
      algorithm_(solid_),
      values_(job.solid->channel_count()),
      plane_(job.job.planes[1], job.solid->summary().channels[0], 0),
      points_(lattice_.width),
      inside_(lattice_.width),
      line_(lattice_.width),
      previous_(lattice_.width) {}

void LiteralMethod::load(const LayerShape& shape) {
  if (layer_ == shape.layer) return;
  layer_ = shape.layer;
  z_mm_ = shape.z_mm;
  polygons_.clear();
  for (const ContourLoop& loop : shape.contours.loops) {
    oracle::Polygon& polygon = polygons_.emplace_back();
    for (const ContourPoint& point : loop.points) polygon.push_back(point.xy);
  }
  occupancy_ = to_bit_image(shape.spans, lattice_.width, lattice_.height);
  plane_.clear(lattice_.width, lattice_.height);
}

LiteralCost LiteralMethod::run_band(const LayerShape& shape, std::uint32_t first_row, std::uint32_t rows,
                                    bool coherence) {
  load(shape);
  LiteralCost cost, warm_up;
  std::fill(previous_.begin(), previous_.end(), std::nullopt);
  if (coherence && first_row > 0) {
    test_occupancy(first_row - 1, warm_up);
    invert_row(first_row - 1, coherence, warm_up);
  }
  for (std::uint32_t row = first_row; row < first_row + rows; ++row) {
    ++cost.rows;
    test_occupancy(row, cost);
    invert_row(row, coherence, cost);
  }
  return cost;
}

void LiteralMethod::test_occupancy(std::uint32_t row, LiteralCost& cost) {
  timed(cost.winding_ns, [&] {
    for (std::uint32_t x = 0; x < lattice_.width; ++x) {
      points_[x] = lattice_.centre(x, row, z_mm_);
      inside_[x] = oracle::winding_number(polygons_, points_[x].head<2>()) != 0;
    }
  });
  for (std::uint32_t x = 0; x < lattice_.width; ++x) {
    cost.voxels += inside_[x];
    cost.disagreeing += inside_[x] != occupancy_.get(x, row);
  }
}

void LiteralMethod::invert_row(std::uint32_t row, bool coherence, LiteralCost& cost) {
  const std::size_t full_before = algorithm_.full_inversions();
  timed(cost.material_ns, [&] {
    if (coherence) {
      algorithm_.invert_line(points_, inside_, previous_, line_);
    } else {
      for (std::uint32_t x = 0; x < lattice_.width; ++x) {
        line_[x] = inside_[x] ? algorithm_.invert(points_[x]) : std::nullopt;
      }
    }
    for (std::uint32_t x = 0; x < lattice_.width; ++x) {
      if (!line_[x]) continue;
      solid_.evaluator().mat(*line_[x], values_);
      plane_.set(std::size_t{row} * lattice_.width + x, values_);
    }
  });
  cost.full += algorithm_.full_inversions() - full_before;
  for (std::uint32_t x = 0; x < lattice_.width; ++x) cost.not_found += inside_[x] && !line_[x];
  std::swap(line_, previous_);
}

}  // namespace ccslice::bench
