// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The leaves of a layer: the boxes of the boundary faces that the plane may meet, halved until each is resolved or
// small (contour.h says what that means), and the side of the plane on which each of their corners lies.
//
// A corner's side is decided once, by the first leaf that has it: faces that meet there agree though their control nets
// round differently. What is dropped lies on one side by more than the margin, hence cannot disagree with a neighbour.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/contour/bezier_net.h"
#include "core/contour/surface_mesh.h"

namespace ccslice {

struct ContourLeaf {
  SurfaceBox box;
  bool resolved = true;    // Otherwise accepted for its size.
  bool irregular = false;  // What remains at an irregular vertex: sides 0 and 3 are straight stand-ins in `net`.
  BezierNet net;           // x, y in the plane; z = height above it.
};

enum class PlaneSide : std::uint8_t { kUnknown, kBelow, kAbove };

/// A height of zero is below.
constexpr PlaneSide side_of(double height) { return height > 0 ? PlaneSide::kAbove : PlaneSide::kBelow; }

struct LeafCriteria {
  AffineMap to_plane;       // Mesh frame -> (x, y, height above the plane).
  double margin_mm = 0;     // Hulls farther than this from the plane are dropped.
  double tolerance_mm = 0;  // For the chord bound.
  double small_mm = 0;      // Leaves whose in-plane diagonal is below need not be resolved.
  CancellationToken cancel = {};
};

class ContourLeaves {
 public:
  explicit ContourLeaves(const BoundarySurface& surface) : surface_(surface), vertices_(surface) {}

  /// Forgets the last layer. `faces`: those that the plane may meet, ascending.
  void collect(std::span<const std::uint32_t> faces, const LeafCriteria& criteria);

  std::span<const ContourLeaf> leaves() const { return leaves_; }
  const SurfaceVertices& vertices() const { return vertices_; }
  PlaneSide side(std::uint32_t vertex) const { return sides_[vertex]; }
  void set_side(std::uint32_t vertex, PlaneSide side) { sides_[vertex] = side; }

 private:
  void collect_irregular(std::uint32_t face);
  void collect_box(const BezierNet& net, const SurfaceBox& box);
  void halve_box(const BezierNet& net, const SurfaceBox& box);
  void add(const ContourLeaf& leaf);
  void enter_vertex(std::uint32_t face, const std::array<std::uint32_t, 2>& at, double height);

  const BoundarySurface& surface_;
  SurfaceVertices vertices_;
  std::vector<PlaneSide> sides_;
  std::vector<ContourLeaf> leaves_;
  LeafCriteria criteria_;
  IrregularCorner corner_;  // Reused memory.
  std::vector<Vec3> split_scratch_;
};

}  // namespace ccslice
