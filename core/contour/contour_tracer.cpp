// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_tracer.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/contour/contour_leaves.h"
#include "core/contour/contour_stitcher.h"
#include "core/contour/side_solver.h"

namespace ccslice {
namespace {

/// Share of the tolerance for chords; the rest is for points that are left out because they repeat their neighbours.
constexpr double kChordShare = 0.99;
/// Points nearer than this to the one before repeat it: vertices on the plane give one point for each of their edges.
constexpr double kRepeatedLifts = 10;
constexpr std::size_t kLeavesPerPoll = 256;

AffineMap plane_map(const ContourIndex& index, const SlicePlane& plane) {
  Mat3 axes;
  axes.row(0) = plane.x_axis;
  axes.row(1) = plane.y_axis;
  axes.row(2) = index.normal();
  AffineMap map{axes * index.placement().linear(), axes * (index.placement().translation() - plane.origin)};
  map.offset.z() -= index.lift_mm();
  return map;
}

/// On the rim of a leaf, walked counter-clockwise.
struct RimCrossing {
  std::uint32_t id = 0;
  bool rises = false;  // From below to above.
};

}  // namespace

struct ContourTracer::State {
  State(const LimitSolid& solid, std::shared_ptr<const ContourIndex> the_index)
      : surface(solid), index(std::move(the_index)), leaves(surface), solver(surface) {}

  Contours trace(const SlicePlane& plane, const ContourOptions& options);
  void collect_rim(const ContourLeaf& leaf);
  PlaneSide side_at(const ContourLeaf& leaf, int side, const RimVertex& vertex);
  std::uint32_t crossing_between(const ContourLeaf& leaf, int side, const RimVertex& from, const RimVertex& to);
  void link_rim(const ContourLeaf& leaf);

  BoundarySurface surface;
  std::shared_ptr<const ContourIndex> index;
  ContourLeaves leaves;
  SideSolver solver;
  IdTable<VertexPair> edges;  // Edge -> crossing of the same number.
  ContourStitcher stitcher;
  std::vector<RimCrossing> rim;
  std::vector<std::uint32_t> faces;
};

Contours ContourTracer::State::trace(const SlicePlane& plane, const ContourOptions& options) {
  const LeafCriteria criteria{.to_plane = plane_map(*index, plane),
                              .margin_mm = index->margin_mm(),
                              .tolerance_mm = kChordShare * options.tolerance_mm,
                              .small_mm = 0.5 * options.smallest_feature_mm,
                              .cancel = options.cancel};
  index->faces_at(plane.origin.dot(index->normal()), faces);
  leaves.collect(faces, criteria);
  solver.start(criteria.to_plane);
  edges.clear();
  stitcher.clear();

  Contours result;
  std::size_t done = 0;
  for (const ContourLeaf& leaf : leaves.leaves()) {
    if (++done % kLeavesPerPoll == 0) options.cancel.throw_if_cancelled();
    collect_rim(leaf);
    if (rim.empty()) continue;
    ++result.leaves;
    result.unresolved_leaves += !leaf.resolved;
    link_rim(leaf);
  }
  result.loops = stitcher.loops(kRepeatedLifts * index->lift_mm());
  return result;
}

void ContourTracer::State::collect_rim(const ContourLeaf& leaf) {
  rim.clear();
  leaves.vertices().walk_rim(leaf.box, [&](int side, const RimVertex& from, const RimVertex& to) {
    const PlaneSide from_side = side_at(leaf, side, from), to_side = side_at(leaf, side, to);
    if (from_side == to_side) return;
    rim.push_back({crossing_between(leaf, side, from, to), to_side == PlaneSide::kAbove});
  });
}

PlaneSide ContourTracer::State::side_at(const ContourLeaf& leaf, int side, const RimVertex& vertex) {
  if (leaves.side(vertex.id) == PlaneSide::kUnknown) {
    leaves.set_side(vertex.id, side_of(solver.height(leaf, side, vertex.s, vertex.t)));
  }
  return leaves.side(vertex.id);
}

std::uint32_t ContourTracer::State::crossing_between(const ContourLeaf& leaf, int side, const RimVertex& from,
                                                     const RimVertex& to) {
  const auto [id, is_new] = edges.insert({std::min(from.id, to.id), std::max(from.id, to.id)});
  if (is_new) {
    const SidePoint point =
        solver.crossing(leaf, side, {from.s, from.t, leaves.side(from.id)}, {to.s, to.t, leaves.side(to.id)});
    stitcher.add_crossing({leaf.box.face, point.s, point.t, point.xy});
  }
  return id;
}

/// Contours keep what is above the plane on their left in a face's frame, and so material on their left in the plane:
/// they enter a leaf where its rim falls and leave it where its rim rises. With more than one of each the middle
/// decides whether the parts above or the parts below are joined.
void ContourTracer::State::link_rim(const ContourLeaf& leaf) {
  const std::size_t count = rim.size();
  const bool middle_above = side_of(evaluate_middle(leaf.net.z)) == PlaneSide::kAbove;
  for (std::size_t k = 0; k < count; ++k) {
    if (rim[k].rises) continue;
    const std::size_t exit = middle_above ? k + 1 : k + count - 1;
    const std::uint32_t entered = rim[k].id, left = rim[exit % count].id;
    index->mirrored() ? stitcher.add_segment(left, entered) : stitcher.add_segment(entered, left);
  }
}

ContourTracer::ContourTracer(const LimitSolid& solid, std::shared_ptr<const ContourIndex> index)
    : state_(std::make_unique<State>(solid, std::move(index))) {}
ContourTracer::~ContourTracer() = default;
ContourTracer::ContourTracer(ContourTracer&&) noexcept = default;
ContourTracer& ContourTracer::operator=(ContourTracer&&) noexcept = default;

Contours ContourTracer::trace(const SlicePlane& plane, const ContourOptions& options) {
  return state_->trace(plane, options);
}

}  // namespace ccslice
