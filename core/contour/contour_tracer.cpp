// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_tracer.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/contour/contour_leaves.h"
#include "core/contour/side_solver.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kNoCrossing = ~std::uint32_t{0};
/// Share of the tolerance for chords; the rest is for points that are left out because they repeat their neighbours.
constexpr double kChordShare = 0.99;
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

/// Where an edge between two vertices of the leaf mesh crosses the plane.
struct Crossing {
  ContourPoint point;
  std::uint32_t next = kNoCrossing;  // Along the loop.
};

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
  void link(std::uint32_t from, std::uint32_t to);
  std::vector<ContourLoop> loops();

  BoundarySurface surface;
  std::shared_ptr<const ContourIndex> index;
  ContourLeaves leaves;
  SideSolver solver;
  IdTable<VertexPair> edges;  // Edge -> crossing of the same number.
  std::vector<Crossing> crossings;
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
  crossings.clear();

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
  result.loops = loops();
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
    crossings.push_back({{leaf.box.face, point.s, point.t, point.xy}, kNoCrossing});
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
    link(rim[k].id, rim[exit % count].id);
  }
}

void ContourTracer::State::link(std::uint32_t from, std::uint32_t to) {
  if (index->mirrored()) std::swap(from, to);
  if (crossings[from].next != kNoCrossing) throw Error(ErrorCode::kInternal, "a contour forks");
  crossings[from].next = to;
}

/// Loops start at their lowest crossing, the first that was found.
std::vector<ContourLoop> ContourTracer::State::loops() {
  std::vector<ContourLoop> loops;
  const double repeated_mm = 10 * index->lift_mm();
  for (std::uint32_t start = 0; start < crossings.size(); ++start) {
    if (crossings[start].next == kNoCrossing) continue;
    ContourLoop loop;
    for (std::uint32_t at = start; at != start || loop.points.empty();) {
      const ContourPoint& point = crossings[at].point;
      if (loop.points.empty() || (point.xy - loop.points.back().xy).norm() > repeated_mm) loop.points.push_back(point);
      at = std::exchange(crossings[at].next, kNoCrossing);
      if (at == kNoCrossing) throw Error(ErrorCode::kInternal, "a contour doesn't close");
    }
    while (loop.points.size() > 1 && (loop.points.back().xy - loop.points.front().xy).norm() <= repeated_mm) {
      loop.points.pop_back();
    }
    if (loop.points.size() >= 3) loops.push_back(std::move(loop));
  }
  return loops;
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
