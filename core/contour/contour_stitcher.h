// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Segments of contours, one polyline for each arc in a leaf, joined into loops. Every crossing of the plane with an
// edge of the leaf mesh ends two segments, one in each leaf at that edge; so following segments always comes back to
// the start.
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
  const ContourPoint& crossing(std::uint32_t id) const { return crossings_[id].point; }
  /// The points that are added next, until the segment is, lie between its ends, in order.
  void add_between(const ContourPoint& point) { between_.push_back(point); }
  /// Throws Error{kInternal} if a crossing would end a third segment.
  void add_segment(std::uint32_t from, std::uint32_t to);

  /// All loops, by their lowest crossing, starting there; crossings that end no segment are in none. Points no farther
  /// than `repeated_mm` from the one before are left out, and so are loops of which fewer than three points remain.
  /// Throws Error{kInternal} if a loop doesn't close.
  std::vector<ContourLoop> loops(double repeated_mm);

  /// By segment, in the order in which they were added: it runs against most of those of its loop. Throws as loops().
  std::vector<bool> segments_against();

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Crossing {
    ContourPoint point;
    std::array<std::uint32_t, 2> segments;
  };
  struct Segment {
    std::uint32_t from, to;
    std::size_t begin, end;  // In between_.
  };
  struct Step {
    std::uint32_t segment;
    bool forward;
  };

  /// Calls visit() for each loop, whose steps are in path_ then.
  template <typename Visit>
  void for_each_loop(const Visit& visit);
  /// Writes the steps of the loop through `start` to path_ and marks its crossings; in the direction of most segments.
  void follow(std::uint32_t start);
  ContourLoop loop_of_path(double repeated_mm) const;

  std::vector<Crossing> crossings_;
  std::vector<Segment> segments_;
  std::vector<ContourPoint> between_;
  std::vector<bool> visited_;  // By crossing.
  std::vector<Step> path_;
};

}  // namespace ccslice
