// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The arc in which a plane cuts a leaf, as a polyline within the tolerance of the surface.
//
// Where the height rises strictly along t, the arc is a graph t(s): for each s it is the only root of a cubic, found by
// Newton's method kept between bounds, four places at a time. Likewise with s and t exchanged. Between two points of
// the arc the surface over the line of parameters from one to the other stays within (|S_ss| ds^2 + 2 |S_st| ds dt +
// |S_tt| dt^2) / 8 of the chord (bezier_net.h); chords are parted until that is below the tolerance.

#pragma once

#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/contour/contour_leaves.h"

namespace ccslice {

/// A point of an arc, in a leaf's box and in the plane.
struct ArcPoint {
  double s = 0, t = 0;     // In [0,1]^2.
  Vec2 xy = Vec2::Zero();  // Along the plane's axes, mm.
};

/// Keeps its memory from arc to arc.
class ArcTracer {
 public:
  /// The arc at a height from one end to the other, both included. Valid until the next call. REQUIRES: the leaf's
  /// level lines are graphs.
  std::span<const ArcPoint> trace(const LeafSurface& leaf, double height_mm, const ArcPoint& from, const ArcPoint& to,
                                  double tolerance_mm);

 private:
  [[nodiscard]] bool part_chords(const ChordBound& bound, double tolerance_mm);
  void solve(const BezierNet& net, double height_mm);

  bool along_s_ = true;  // The arc is a graph t(s).
  std::vector<ArcPoint> points_, parted_;
  std::vector<std::size_t> unsolved_;  // Indices into points_.
};

}  // namespace ccslice
