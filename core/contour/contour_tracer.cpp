// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_tracer.h"

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "core/contour/arc_tracer.h"
#include "core/contour/contour_leaves.h"
#include "core/contour/contour_stitcher.h"
#include "core/contour/orient_regions.h"
#include "core/contour/side_solver.h"

namespace ccslice {
namespace {

/// Share of the tolerance for chords; the rest is for points that are left out because they repeat their neighbours.
constexpr double kChordShare = 0.99;
/// Points nearer than this to the one before repeat it: vertices on the plane give one point for each of their edges.
constexpr double kRepeatedLifts = 10;
constexpr std::size_t kLeavesPerPoll = 256;

AffineMap axes_map(const ContourIndex& index, const SlicePlane& plane) {
  Mat3 axes;
  axes.row(0) = plane.x_axis;
  axes.row(1) = plane.y_axis;
  axes.row(2) = index.normal();
  return {axes * index.placement().linear(), axes * index.placement().translation()};
}

/// Where the plane crosses the rim of a leaf, walked counter-clockwise.
struct RimCrossing {
  std::uint32_t id = 0;
  bool rises = false;   // From below to above.
  double s = 0, t = 0;  // In the leaf's box.
};

/// Where a crossing lies on its edge: this share of the way from one vertex to the other.
struct EdgeShare {
  std::uint32_t from = 0;
  double share = 0;
};

}  // namespace

struct ContourTracer::State {
  State(const LimitSolid& solid, std::shared_ptr<const ContourIndex> the_index)
      : surface(solid),
        index(std::move(the_index)),
        leaves(surface),
        solver(surface),
        has_several_regions(solid.has_several_regions()),
        has_inverted_cells(!solid.summary().inverted_control_cells.empty()) {}

  Contours trace(const SlicePlane& plane, const ContourOptions& options);
  void start(const SlicePlane& plane, const ContourOptions& options);
  void collect_rim(const ContourLeaf& leaf);
  PlaneSide side_at(const LeafSurface& leaf, int side, const RimVertex& vertex);
  std::uint32_t crossing_between(const LeafSurface& leaf, int side, const RimVertex& from, const RimVertex& to);
  void link_rim(const LeafSurface& leaf);
  void add_segment(const LeafSurface& leaf, const RimCrossing& from, const RimCrossing& to);
  void add_region_edges(const BoundaryFace& face, std::uint32_t from, std::span<const ContourPoint> between,
                        std::uint32_t to);

  BoundarySurface surface;
  std::shared_ptr<const ContourIndex> index;
  ContourLeaves leaves;
  SideSolver solver;
  ArcTracer arcs;
  IdTable<VertexPair> edges;      // Edge -> crossing of the same number.
  std::vector<EdgeShare> shares;  // By crossing.
  ContourStitcher stitcher;
  const bool has_several_regions, has_inverted_cells;
  std::vector<RegionEdge> region_edges;
  std::vector<RegionSegment> region_segments;  // Only where cells are inverted.
  std::vector<ContourPoint> between;           // The points of an arc between its ends.
  std::vector<RimCrossing> rim;
  std::vector<BoundaryFaceId> faces;
  double height_mm = 0, tolerance_mm = 0;
  Vec2 origin = Vec2::Zero();  // The plane's, along its axes.
};

void ContourTracer::State::start(const SlicePlane& plane, const ContourOptions& options) {
  const double plane_mm = plane.origin.dot(index->normal());
  height_mm = plane_mm + index->lift_mm();
  tolerance_mm = kChordShare * options.tolerance_mm;
  origin = {plane.origin.dot(plane.x_axis), plane.origin.dot(plane.y_axis)};
  const LeafCriteria criteria{.to_axes = axes_map(*index, plane),
                              .height_mm = height_mm,
                              .margin_mm = index->margin_mm(),
                              .tolerance_mm = tolerance_mm,
                              .small_mm = 0.5 * options.smallest_feature_mm,
                              .cancel = options.cancel};
  index->faces_at(plane_mm, faces);
  leaves.collect(faces, criteria);
  solver.start(criteria.to_axes, height_mm);
  edges.clear();
  shares.clear();
  stitcher.clear();
  region_edges.clear();
  region_segments.clear();
}

Contours ContourTracer::State::trace(const SlicePlane& plane, const ContourOptions& options) {
  start(plane, options);
  Contours result;
  std::size_t done = 0;
  for (const ContourLeaf& leaf : leaves.leaves()) {
    if (++done % kLeavesPerPoll == 0) options.cancel.throw_if_cancelled();
    collect_rim(leaf);
    if (rim.empty()) continue;
    ++result.leaves;
    result.unresolved_leaves += !leaf.resolved;
    link_rim(leaves.surface(leaf));
  }
  result.loops = stitcher.loops(kRepeatedLifts * index->lift_mm());
  if (has_inverted_cells) orient_regions(region_segments, edges.size(), region_edges);
  result.region_edges = std::move(region_edges);
  return result;
}

void ContourTracer::State::collect_rim(const ContourLeaf& id) {
  rim.clear();
  const LeafSurface leaf = leaves.surface(id);
  const SurfaceBox& box = leaf.node.box;
  const double scale = 1.0 / box.size;
  leaves.walk_rim(id, [&](int side, const RimVertex& from, const RimVertex& to) {
    const PlaneSide from_side = side_at(leaf, side, from), to_side = side_at(leaf, side, to);
    if (from_side == to_side) return;
    const std::uint32_t id = crossing_between(leaf, side, from, to);
    const double share = shares[id].from == from.id ? shares[id].share : 1 - shares[id].share;
    const auto between = [=](std::uint32_t a, std::uint32_t b, std::uint32_t begin) {
      return ((1 - share) * (a - begin) + share * (b - begin)) * scale;
    };
    rim.push_back({id, to_side == PlaneSide::kAbove, between(from.s, to.s, box.s), between(from.t, to.t, box.t)});
  });
}

PlaneSide ContourTracer::State::side_at(const LeafSurface& leaf, int side, const RimVertex& vertex) {
  if (leaves.side(vertex.id) == PlaneSide::kUnknown) {
    leaves.set_side(vertex.id, side_of(solver.height(leaf, side, vertex.s, vertex.t)));
  }
  return leaves.side(vertex.id);
}

std::uint32_t ContourTracer::State::crossing_between(const LeafSurface& leaf, int side, const RimVertex& from,
                                                     const RimVertex& to) {
  const auto [id, is_new] = edges.insert({std::min(from.id, to.id), std::max(from.id, to.id)});
  if (is_new) {
    const SidePoint point =
        solver.crossing(leaf, side, {from.s, from.t, leaves.side(from.id)}, {to.s, to.t, leaves.side(to.id)});
    stitcher.add_crossing({leaf.node.box.face, point.s, point.t, point.xy - origin});
    constexpr double kUnit = 1.0 / kSurfaceOne;
    const double begin = (side % 2 == 0 ? from.s : from.t) * kUnit, end = (side % 2 == 0 ? to.s : to.t) * kUnit;
    shares.push_back({from.id, ((side % 2 == 0 ? point.s : point.t) - begin) / (end - begin)});
  }
  return id;
}

/// Contours keep what is above the plane on their left in a face's frame, and so material on their left in the plane:
/// they enter a leaf where its rim falls and leave it where its rim rises. With more than one of each the middle
/// decides whether the parts above or the parts below are joined.
void ContourTracer::State::link_rim(const LeafSurface& leaf) {
  const std::size_t count = rim.size();
  const bool middle_above = count > 2 && evaluate_middle(leaf.net.z) > height_mm;
  for (std::size_t k = 0; k < count; ++k) {
    if (rim[k].rises) continue;
    const RimCrossing& entered = rim[k];
    const RimCrossing& left = rim[(middle_above ? k + 1 : k + count - 1) % count];
    index->mirrored() ? add_segment(leaf, left, entered) : add_segment(leaf, entered, left);
  }
}

void ContourTracer::State::add_segment(const LeafSurface& leaf, const RimCrossing& from, const RimCrossing& to) {
  const auto& [box, lines] = std::tie(leaf.node.box, leaf.node.level_lines);
  between.clear();
  if (!leaf.node.remainder && lines != LevelLines::kUnknown && lines != LevelLines::kOpen) {
    const auto end = [&](const RimCrossing& at) { return ArcPoint{at.s, at.t, stitcher.crossing(at.id).xy + origin}; };
    const std::span<const ArcPoint> arc = arcs.trace(leaf, height_mm, end(from), end(to), tolerance_mm);
    constexpr double kUnit = 1.0 / kSurfaceOne;
    const double size = box.size * kUnit, s = box.s * kUnit, t = box.t * kUnit;
    for (const ArcPoint& point : arc.subspan(1, arc.size() - 2)) {
      between.push_back({box.face, s + point.s * size, t + point.t * size, point.xy - origin});
    }
  }
  const BoundaryFace& face = surface.faces_and_interfaces()[box.face];
  if (has_several_regions) add_region_edges(face, from.id, between, to.id);
  if (face.beyond != kNoCellRegion) return;
  for (const ContourPoint& point : between) stitcher.add_between(point);
  stitcher.add_segment(from.id, to.id);
}

void ContourTracer::State::add_region_edges(const BoundaryFace& face, std::uint32_t from,
                                            std::span<const ContourPoint> between, std::uint32_t to) {
  const std::size_t begin = region_edges.size();
  Vec2 last = stitcher.crossing(from).xy;
  const auto go_to = [&](const Vec2& next) {
    region_edges.push_back({last, next, face.region, face.beyond});
    last = next;
  };
  for (const ContourPoint& point : between) go_to(point.xy);
  go_to(stitcher.crossing(to).xy);
  if (has_inverted_cells) region_segments.push_back({from, to, begin, region_edges.size()});
}

ContourTracer::ContourTracer(const LimitSolid& solid, std::shared_ptr<const ContourIndex> index)
    : state_(std::make_unique<State>(solid, std::move(index))) {}
ContourTracer::~ContourTracer() = default;
ContourTracer::ContourTracer(ContourTracer&&) noexcept = default;
ContourTracer& ContourTracer::operator=(ContourTracer&&) noexcept = default;

void ContourTracer::follow(std::shared_ptr<const ContourIndex> index) { state_->index = std::move(index); }

Contours ContourTracer::trace(const SlicePlane& plane, const ContourOptions& options) {
  return state_->trace(plane, options);
}

}  // namespace ccslice
