// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The walk down to the irregular vertex of a vertex cell, level by level: its star steps on by itself, and the cell's
// own points and its outer children follow from what the star is before and after the step (operators.h).
//
// Private to core/limit.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/subdivision/operator_table.h"

namespace ccslice {

/// Copies chosen points of `dimension` doubles each; returns the end of what it wrote.
inline double* gather_points(std::span<const std::uint32_t> chosen, const double* from, std::size_t dimension,
                             double* out) noexcept {
  if (dimension == kLanes) {  // A call to copy a register would take longer than that does.
    for (const std::uint32_t p : chosen) store_unaligned(load_unaligned(from + p * kLanes), out), out += kLanes;
    return out;
  }
  for (const std::uint32_t p : chosen) out = std::copy_n(from + p * dimension, dimension, out);
  return out;
}

/// One thread. Allocates when it is made only.
class VertexWalk {
 public:
  /// `dimension`: doubles a point. REQUIRES: `operators` outlives this.
  VertexWalk(const OperatorTable& operators, std::size_t dimension);

  /// Starts at the ring of a vertex cell, whose points are to be written to the result: its star's, then its own.
  std::span<double> start(std::uint32_t op) noexcept;
  /// Goes on to the sub-cell at the vertex.
  void descend() noexcept;
  /// Makes what all sub-cells at this level consist of, most of which they share: faster than one by one, if nearly all
  /// are wanted.
  void make_children() noexcept;
  /// Writes the points of an outer sub-cell (1 to 7) as its rows have them, phantoms zero.
  const CornerOperator::Child& make_child(std::size_t number, double* out) noexcept;

  /// The corner operator at this level.
  std::uint32_t op() const noexcept { return corner_; }
  const CornerOperator& corner() const noexcept { return operators_->corners()[corner_]; }
  const StarOperator& star() const noexcept { return operators_->stars()[star_]; }
  /// The ring's points, the star's first. The limit at the vertex depends on those alone.
  std::span<const double> points() const noexcept { return std::span(points_).first(point_count() * dimension_); }
  /// Moves and scales all points: p becomes scale * (p - origin). REQUIRES: dimension doubles.
  void rescale(std::span<const double> origin, double scale) noexcept;

 private:
  std::size_t point_count() const noexcept { return star().points + corner().own; }
  /// Fills columns_ and next_star_.
  void step_star() noexcept;
  /// Writes a sub-cell's points.
  void make(const ChildRows& child, double* out) noexcept;

  const OperatorTable* operators_;
  std::size_t dimension_;
  std::uint32_t star_ = 0, corner_ = 0;
  std::vector<std::uint32_t> shared_, next_shared_;  // Numbers in the star of the corner's shared points.
  std::vector<double> points_;                       // The star's, then the corner's own.
  std::vector<double> next_star_;                    // One level on, if stepped_.
  std::vector<double> columns_;                      // As the corner operator wants them, if stepped_.
  std::vector<double> made_;                         // A point for each of the corner's rows, if children_made_.
  bool stepped_ = false, children_made_ = false;
};

}  // namespace ccslice
