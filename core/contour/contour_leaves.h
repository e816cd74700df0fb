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
#include "core/contour/surface_tree.h"

namespace ccslice {

struct ContourLeaf {
  std::uint32_t node = 0;
  bool resolved = true;  // Otherwise accepted for its size.
};

/// Where the plane crosses a leaf; its level lines are what the tree knows.
struct LeafSurface {
  const SurfaceNode& node;
  const BezierNet& net;
};

enum class PlaneSide : std::uint8_t { kUnknown, kBelow, kAbove };

/// A height of zero is below.
constexpr PlaneSide side_of(double height) { return height > 0 ? PlaneSide::kAbove : PlaneSide::kBelow; }

struct LeafCriteria {
  AffineMap to_axes;        // Mesh frame -> coordinates along the plane's axes, and the height.
  double height_mm = 0;     // Height of the plane.
  double margin_mm = 0;     // Hulls farther than this from the plane are dropped.
  double tolerance_mm = 0;  // For the chord bound of leaves whose level lines can't be followed.
  double small_mm = 0;      // Leaves whose in-plane diagonal is below need not be resolved.
  CancellationToken cancel = {};
};

class ContourLeaves {
 public:
  explicit ContourLeaves(const BoundarySurface& surface) : tree_(surface) {}

  /// Forgets the last layer. `faces`: those that the plane may meet, ascending.
  void collect(std::span<const BoundaryFaceId> faces, const LeafCriteria& criteria);

  std::span<const ContourLeaf> leaves() const { return leaves_; }
  /// How many nodes the layer visited, and how many are kept of all layers.
  std::size_t visited_nodes() const { return visited_; }
  std::size_t kept_nodes() const { return tree_.node_count(); }
  /// Valid until the next collect().
  LeafSurface surface(const ContourLeaf& leaf) const { return {tree_.node(leaf.node), tree_.net(leaf.node)}; }
  PlaneSide side(std::uint32_t vertex) const { return marks_[vertex].side; }
  void set_side(std::uint32_t vertex, PlaneSide side) { marks_[vertex].side = side; }

  /// Calls visit(side, from, to) for each finest edge round a leaf, counter-clockwise.
  template <class Visit>
  void walk_rim(const ContourLeaf& leaf, Visit&& visit);

 private:
  /// What the layer at hand knows of a vertex.
  struct Mark {
    std::uint32_t layer = 0;
    PlaneSide side = PlaneSide::kUnknown;
  };

  void start(const LeafCriteria& criteria);
  void collect_node(std::uint32_t id);
  [[nodiscard]] bool accept(std::uint32_t id, const SurfaceNode& node);
  [[nodiscard]] bool accept_remainder(std::uint32_t id, const SurfaceNode& node);
  void add(std::uint32_t id, bool resolved);
  bool is_dropped(const SurfaceNode& node) const;
  bool is_simple(std::uint32_t id, const SurfaceNode& node) const;
  bool lies_in_plane(const SurfaceNode& node) const;
  PlaneSide raw_side(double z) const { return side_of(z - criteria_.height_mm); }
  Mark& mark(std::uint32_t vertex);
  /// The vertex if the layer at hand has it, else kNone.
  std::uint32_t marked(std::uint32_t vertex) const;
  template <class Visit>
  void walk_parted_side(std::uint32_t id, int side, const RimVertex& from, const RimVertex& to, Visit& visit);

  SurfaceTree tree_;
  std::vector<Mark> marks_;  // By vertex.
  std::uint32_t layer_ = 0;  // Counts layers: marks of others don't hold.
  std::size_t visited_ = 0;  // Nodes, in this layer.
  std::vector<ContourLeaf> leaves_;
  LeafCriteria criteria_;
  double small_remainder_mm_ = 0;
};

inline std::uint32_t ContourLeaves::marked(std::uint32_t vertex) const {
  const bool in_layer = vertex < marks_.size() && marks_[vertex].layer == layer_;
  return in_layer ? vertex : SurfaceTree::kNone;
}

template <class Visit>
void ContourLeaves::walk_rim(const ContourLeaf& leaf, Visit&& visit) {
  const SurfaceNode& node = tree_.node(leaf.node);
  std::array<RimVertex, 4> corners;
  for (int k = 0; k < 4; ++k) {
    const auto [s, t] = node.box.corner(k);
    corners[k] = {node.corners[k], s, t};
  }
  for (int k = 0; k < 4; ++k) {
    const RimVertex &from = corners[k], &to = corners[(k + 1) % 4];
    if (marked(node.middles[k]) == SurfaceTree::kNone) {
      visit(k, from, to);
    } else {
      walk_parted_side(leaf.node, k, from, to, visit);
    }
  }
}

/// Most of these have no finer vertices than their middle.
template <class Visit>
void ContourLeaves::walk_parted_side(std::uint32_t id, int side, const RimVertex& from, const RimVertex& to,
                                     Visit& visit) {
  const std::array<std::uint32_t, 8>& quarters = tree_.quarters(id);
  const SurfaceNode& node = tree_.node(id);
  const auto vertex_at = [&](std::uint32_t s, std::uint32_t t) {
    return marked(tree_.vertices().find(node.box.face, s, t));
  };
  const RimVertex middle{node.middles[side], std::midpoint(from.s, to.s), std::midpoint(from.t, to.t)};
  const auto walk_half = [&](const RimVertex& begin, const RimVertex& end, std::uint32_t quarter) {
    if (marked(quarter) == SurfaceTree::kNone) return visit(side, begin, end);
    walk_side(side, begin, end, vertex_at, visit);
  };
  walk_half(from, middle, quarters[2 * side]);
  walk_half(middle, to, quarters[2 * side + 1]);
}

}  // namespace ccslice
