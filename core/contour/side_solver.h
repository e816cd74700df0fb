// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points ON the limit surface along the sides of leaves: heights at dyadic places, and where a side crosses the plane.
//
// A side of a regular leaf is a cubic. A side that ends at an irregular vertex is a sequence of cubics, one a level,
// found by splitting on: so its crossings are exact too, however close to the vertex.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/contour/contour_leaves.h"

namespace ccslice {

/// A place on a side of a leaf, and on which side of the plane it is.
struct SideEnd {
  std::uint32_t s = 0, t = 0;
  PlaneSide side = PlaneSide::kUnknown;
};

struct SidePoint {
  double s = 0, t = 0;     // In the face's frame, [0,1].
  Vec2 xy = Vec2::Zero();  // Along the plane's axes, mm.
};

class SideSolver {
 public:
  explicit SideSolver(const BoundarySurface& surface) : surface_(surface) {}

  /// Before the first leaf of a layer.
  void start(const AffineMap& to_axes, double height_mm);

  /// Height of the limit surface above the plane at a vertex on side 0-3 of a leaf.
  double height(const LeafSurface& leaf, int side, std::uint32_t s, std::uint32_t t);
  /// Where the side crosses the plane between two vertices on it. REQUIRES: they lie on different sides of the plane.
  SidePoint crossing(const LeafSurface& leaf, int side, const SideEnd& from, const SideEnd& to);

 private:
  static constexpr BoundaryFaceId kNoFace{~std::uint32_t{0}};

  struct Piece {
    BezierCurve curve;          // Heights are above the plane.
    double begin = 0, end = 1;  // Along the side, in the face's frame.
  };

  Piece piece_of(const LeafSurface& leaf, int side, double position);
  /// The side's piece along s (axis 0) or t (axis 1) over [2^-(level+1), 2^-level] from the irregular vertex of a face.
  const BezierCurve& irregular_piece(BoundaryFaceId face, int axis, int level);

  const BoundarySurface& surface_;
  AffineMap to_axes_;
  double height_mm_ = 0;
  BoundaryFaceId irregular_face_ = kNoFace;
  IrregularCorner corner_;  // The corner of irregular_face_, split as often as there are pieces.
  std::vector<std::array<BezierCurve, 2>> irregular_;  // By level, then by axis.
};

}  // namespace ccslice
