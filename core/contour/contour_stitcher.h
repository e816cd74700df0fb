// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Segments of contours, one for each arc in a leaf, joined into loops. Every crossing of the plane with an edge of the
// leaf mesh ends two segments, one in each leaf at that edge; so following segments always comes back to the start.
//
// Segments have material on their left. Where cells are inverted (allow_folds) the frames of neighbouring faces may
// contradict each other: then the majority of a loop's segments decides on its direction.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/contour/contour.h"

namespace ccslice {

class ContourStitcher {
 public:
  void clear();

  /// Crossings are numbered in the order in which they are added.
  void add_crossing(const ContourPoint& point) { crossings_.push_back({point, {kNone, kNone}}); }
  /// Throws Error{kInternal} if a crossing would end a third segment.
  void add_segment(std::uint32_t from, std::uint32_t to);

  /// All loops, by their lowest crossing, starting there. Points no farther than `repeated_mm` from the one before are
  /// left out, and so are loops of which fewer than three points remain. Throws Error{kInternal} if a loop doesn't
  /// close.
  std::vector<ContourLoop> loops(double repeated_mm) const;

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Crossing {
    ContourPoint point;
    std::array<std::uint32_t, 2> segments;
  };
  struct Segment {
    std::uint32_t from, to;
  };

  /// Appends the crossings of the loop through `start` and marks them; in the direction of most of its segments.
  void follow(std::uint32_t start, std::vector<std::uint32_t>& crossings, std::vector<bool>& visited) const;
  ContourLoop loop_of(const std::vector<std::uint32_t>& crossings, double repeated_mm) const;

  std::vector<Crossing> crossings_;
  std::vector<Segment> segments_;
};

}  // namespace ccslice
