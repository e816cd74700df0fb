// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/block_shell.h"

#include <algorithm>
#include <array>

#include "core/interpolation/pieces/block_arcs.h"
#include "core/interpolation/pieces/block_faces.h"
#include "core/interpolation/pieces/face_quarters.h"

namespace ccslice {
namespace {

constexpr double kFlat = 1e-9;  // What is outside by less is flat.

/// The edges of a quadrilateral's triangles: the diagonal that they share, and its sides.
enum Edge : std::size_t { kDiagonal, kLowerS, kLowerT, kUpperS, kUpperT, kEdges };

/// Four quadrilaterals, a lane each: where their edges are farthest outside of the face. Of those that are nowhere
/// outside, how far their middles are: no more than 0.
struct LaneEdges {
  LanePoints outwards;
  unsigned from_lower;  // Those whose diagonal is that from the lower corner, a bit a lane.
  std::array<Lanes, kEdges> heights, shares;

  void set(Edge edge, Lanes middle, Lanes cubic) {
    const HighestOverArcs highest = highest_over_arcs(middle, cubic);
    heights[edge] = highest.height > 0 ? highest.height : middle;
    shares[edge] = highest.height > 0 ? highest.share : Lanes{} + 0.5;
  }
  Lanes most() const {
    return greater(greater(greater(heights[kLowerS], heights[kUpperS]), greater(heights[kLowerT], heights[kUpperT])),
                   heights[kDiagonal]);
  }
};

/// A side of each quadrilateral. With step 1 second differences at its ends count, too.
template <std::size_t Step, typename AtEnd>
void set_side(Edge edge, const ArcBends<Lanes>& bends, AtEnd at_end, std::size_t half, LaneEdges& edges) {
  Lanes middle = middles<Step>(bends, at_end, half);
  if constexpr (Step == 1) {
    const auto& [first, second, third] = bends.at;
    const Lanes begin = at_end ? (half == 0 ? second : third) : first;
    const Lanes end = at_end ? third : (half == 0 ? first : second);
    middle = greater(greater(middle, begin / 8), end / 8);
  }
  edges.set(edge, middle, cubic_of(bends, Step));
}

/// Lanes of the quadrilaterals whose triangles share the diagonal from the lower corner, as BlockRaster chooses it.
auto are_from_lower(const LanePoints& lower, const LanePoints& along_s, const LanePoints& along_t,
                    const LanePoints& upper) {
  const LanePoints rising = lower - upper, falling = along_s - along_t;
  return rising.dot(rising) <= falling.dot(falling);
}

/// The quadrilaterals between every Step-th node of which (s, t) is the lower corner in their quarters.
template <std::size_t Step>
void find_edges(const FaceQuarters& quarters, const BlockShape& shape, std::size_t side, std::size_t s, std::size_t t,
                LaneEdges& edges) {
  const auto at_end_of_s = FaceQuarters::at_end_of_s();
  const auto at_end_of_t = FaceQuarters::at_end_of_t();
  const LanePoints &a = quarters.node(s, t), &b = quarters.node(s + Step, t), &c = quarters.node(s, t + Step),
                   &d = quarters.node(s + Step, t + Step);
  const LanePoints outwards = (side % 2 != 0 ? 1 : -1) * across_quads(shape, side / 2, a, b, c, d);
  edges.outwards = outwards;
  set_side<Step>(kLowerS, across(outwards, quarters.along_s(t)), at_end_of_s, s, edges);
  set_side<Step>(kUpperS, across(outwards, quarters.along_s(t + Step)), at_end_of_s, s, edges);
  set_side<Step>(kLowerT, across(outwards, quarters.along_t(s)), at_end_of_t, t, edges);
  set_side<Step>(kUpperT, across(outwards, quarters.along_t(s + Step)), at_end_of_t, t, edges);

  const auto from_lower = are_from_lower(a, b, c, d);
  edges.from_lower = lanes_of(from_lower);
  const Lanes at_a = outwards.dot(a), at_b = outwards.dot(b), at_c = outwards.dot(c), at_d = outwards.dot(d);
  const Lanes chord = 0.5 * (from_lower ? at_a + at_d : at_b + at_c);
  if constexpr (Step > 1) {
    const Lanes along_s = cubic_of(across(outwards, quarters.along_s(t + 1)), Step),
                along_t = cubic_of(across(outwards, quarters.along_t(s + 1)), Step) *
                          (from_lower ? Lanes{} + 1 : Lanes{} - 1);
    const Lanes cubic = absolute(along_s) + absolute(along_t);
    edges.set(kDiagonal, chord - outwards.dot(quarters.node(s + 1, t + 1)), along_s + along_t < 0 ? -cubic : cubic);
  } else {
    const Lanes of_corners = 0.25 * (at_a + at_b + at_c + at_d);
    const Lanes of_sides = greater(edges.heights[kLowerS], edges.heights[kUpperS]) +
                           greater(edges.heights[kLowerT], edges.heights[kUpperT]);
    edges.heights[kDiagonal] = chord - of_corners + of_sides;
    edges.shares[kDiagonal] = Lanes{} + 0.5;
  }
}

/// Where a chord through the whole of an arc is farthest outside, of the nodes between its ends.
HighestOverArc over_nodes(const ArcBends<double>& bends) {
  const auto& [first, second, third] = bends.at;
  const std::array<double, 3> heights = {(3 * first + 2 * second + third) / 4, (first + 2 * second + third) / 2,
                                         (first + 2 * second + 3 * third) / 4};
  HighestOverArc most{0, 0.5};
  for (std::size_t n = 0; n < heights.size(); ++n) {
    if (heights[n] > most.height) most = {heights[n], static_cast<double>(n + 1) / 4};
  }
  return most;
}

/// Sides of the block, a bit each, that hold both nodes.
unsigned sides_of(std::size_t from, std::size_t to) {
  unsigned sides = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t at = from / kBlockStride[axis] % kBlockNodes;
    if (at != to / kBlockStride[axis] % kBlockNodes) continue;
    if (at == 0) sides |= 1u << (2 * axis);
    if (at + 1 == kBlockNodes) sides |= 1u << (2 * axis + 1);
  }
  return sides;
}

}  // namespace

/// A quadrilateral between every step-th node, and where its edges are farthest outside of the face.
struct BlockShell::Edges {
  std::size_t s, t, step;  // (s, t): the lower corner.
  bool from_lower;
  Eigen::RowVector3d outwards;
  std::array<HighestOverArc, kEdges> highest;
};

void BlockShell::find(const BlockPoints& points, const BlockShape& shape, std::size_t side) {
  depth_ = 0;
  places_.clear();
  quads_.clear();
  if (shape.step == 1) {
    find_in_quarters<1>(points, shape, side);
  } else if (shape.step == 2) {
    find_in_quarters<2>(points, shape, side);
  } else {
    find_in_whole(points, shape, side);
  }
}

template <std::size_t Step>
void BlockShell::find_in_quarters(const BlockPoints& points, const BlockShape& shape, std::size_t side) {
  constexpr std::size_t kHalves = 2 / Step;
  const BlockFace face(side / 2, side % 2);
  const FaceQuarters quarters(points, face);
  std::array<LaneEdges, kHalves * kHalves> edges;
  std::array<unsigned, kHalves * kHalves> outside;
  for (std::size_t place = 0; place < edges.size(); ++place) {
    find_edges<Step>(quarters, shape, side, place % kHalves, place / kHalves, edges[place]);
    outside[place] = lanes_of(edges[place].most() > kFlat);
  }
  for_each_quad(Step, [&](std::size_t s, std::size_t t) {
    const std::size_t place = s % 2 + t % 2 * kHalves, lane = s / 2 + t / 2 * 2;
    if (!(outside[place] >> lane & 1)) return;
    const LaneEdges& of = edges[place];
    Edges quad{
        s, t, Step, (of.from_lower >> lane & 1) != 0, {of.outwards.x[lane], of.outwards.y[lane], of.outwards.z[lane]},
        {}};
    for (std::size_t edge = 0; edge < kEdges; ++edge) {
      quad.highest[edge] = {of.heights[edge][lane], of.shares[edge][lane]};
    }
    add(points, face, quad);
  });
}

/// Triangles as large as the face.
void BlockShell::find_in_whole(const BlockPoints& points, const BlockShape& shape, std::size_t side) {
  constexpr std::size_t kStep = kBlockNodes - 1;
  const BlockFace face(side / 2, side % 2);
  const auto quad = FaceQuarters(points, face).with_corners<kStep>(0, 0, [&](const auto&... corners) {
    const LanePoints outwards = (side % 2 != 0 ? 1 : -1) * across_quads(shape, side / 2, corners...);
    return Edges{
        0, 0, kStep, (lanes_of(are_from_lower(corners...)) & 1) != 0, {outwards.x[0], outwards.y[0], outwards.z[0]},
        {}};
  });
  const auto over = [&](const auto& node) {
    return over_nodes(
        across(quad.outwards, bends_of<Vec3>([&](std::size_t n) -> const Vec3& { return points[node(n)]; })));
  };
  const std::array<HighestOverArc, kEdges> highest = {
      over([&](std::size_t n) { return face.node(n, quad.from_lower ? n : kStep - n); }),
      over([&](std::size_t n) { return face.node(n, 0); }), over([&](std::size_t n) { return face.node(0, n); }),
      over([&](std::size_t n) { return face.node(n, kStep); }),
      over([&](std::size_t n) { return face.node(kStep, n); })};
  add(points, face, {quad.s, quad.t, quad.step, quad.from_lower, quad.outwards, highest});
}

void BlockShell::add(const BlockPoints& points, const BlockFace& face, const Edges& edges) {
  const auto& [s, t, step, from_lower, outwards, highest] = edges;
  const std::size_t a = face.node(s, t), b = face.node(s + step, t), c = face.node(s, t + step),
                    d = face.node(s + step, t + step);
  Quad quad;
  quad.outwards = outwards;
  quad.corners = from_lower ? std::array{a, b, c, d} : std::array{b, a, d, c};
  const auto add_edge = [&](Edge edge, std::size_t from, std::size_t to, bool is_its_own = true) {
    const HighestOverArc& most = edges.highest[edge];
    if (!(most.height > kFlat)) return;
    if (is_its_own) {
      places_.push_back(
          {(1 - most.share) * points[from] + most.share * points[to], edges.outwards, most.height, sides_of(from, to)});
    }
    quad.depth = std::max(quad.depth, most.height);
  };
  add_edge(kDiagonal, from_lower ? a : c, from_lower ? d : b);
  add_edge(kLowerS, a, b);
  add_edge(kLowerT, a, c);
  // The edges at its ends are the next one's, if there is one.
  add_edge(kUpperS, c, d, t + step + 1 == kBlockNodes);
  add_edge(kUpperT, b, d, s + step + 1 == kBlockNodes);
  if (!(quad.depth > 0)) return;
  quads_.push_back(quad);
  depth_ = std::max(depth_, quad.depth);
}

}  // namespace ccslice
