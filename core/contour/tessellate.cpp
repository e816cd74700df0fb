// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/tessellate.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/contour/bezier_net.h"
#include "core/contour/surface_mesh.h"
#include "core/limit/limit_evaluator.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kNoNumber = ~std::uint32_t{0};
constexpr std::size_t kPiecesPerPoll = 256;

/// A place on the surface, as a face's leaf knows it.
struct SurfacePlace {
  BoundaryFaceId face;
  std::uint32_t s = 0, t = 0;
  Vec3 position = Vec3::Zero();  // World.
};

struct Leaf {
  SurfaceBox box;
  Vec3 middle = Vec3::Zero();  // World.
};

Vec3 corner_of(const BezierNet& net, int k) {
  return {net.x[kNetCorner[k]], net.y[kNetCorner[k]], net.z[kNetCorner[k]]};
}

/// Halves the faces down to leaves, and tells of each box that is halved and of each leaf.
class FaceHalver {
 public:
  FaceHalver(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options)
      : surface_(solid), to_world_{placement.linear(), placement.translation()}, options_(options) {}

  const BoundarySurface& surface() const { return surface_; }

  /// Calls visit.halved(box) and visit.leaf(box, corners, middle), in a canonical order.
  template <class Visit>
  void halve_all(Visit& visit) {
    halve(surface_.face_ids(), visit);
  }
  template <class Visit>
  void halve(const IdRange<BoundaryFaceId>& faces, Visit& visit);

 private:
  template <class Visit>
  void halve_irregular(BoundaryFaceId face, Visit& visit);
  template <class Visit>
  void halve_box(const BezierNet& net, const SurfaceBox& box, Visit& visit);

  BoundarySurface surface_;
  AffineMap to_world_;
  const TessellationOptions& options_;
  IrregularCorner corner_;
};

void check_count(std::uint64_t triangles, const TessellationOptions& options) {
  if (triangles <= options.max_triangles) return;
  throw Error(ErrorCode::kTooManyTriangles,
              "chord_tolerance_mm is so small that the boundary takes more than " +
                  std::to_string(options.max_triangles) + " triangles; choose a larger one",
              "chord_tolerance_mm");
}

void require_tolerance(const TessellationOptions& options) {
  if (options.tolerance_mm > 0 && std::isfinite(options.tolerance_mm)) return;
  throw Error(ErrorCode::kToleranceInvalid, "chord_tolerance_mm must be positive and finite", "chord_tolerance_mm");
}

struct LeafVisit {
  const TessellationOptions& options;
  const std::function<void(const std::array<Vec3, 4>&)>& visit;
  std::uint64_t leaves = 0;

  void halved(const SurfaceBox&) {}
  void leaf(const SurfaceBox&, const std::array<Vec3, 4>& corners, const Vec3&) {
    if (leaves++ % kPiecesPerPoll == 0) options.cancel.throw_if_cancelled();
    visit(corners);
  }
};

struct LeafCount {
  const TessellationOptions& options;
  std::uint64_t leaves = 0;

  void halved(const SurfaceBox&) {}
  void leaf(const SurfaceBox&, const std::array<Vec3, 4>&, const Vec3&) {
    if (leaves % kPiecesPerPoll == 0) options.cancel.throw_if_cancelled();
    check_count(2 * ++leaves, options);
  }
};

/// Halving a leaf makes three leaves more, and at most five vertices. Every triangle has an edge of its leaf's rim. At
/// most two sides of a leaf have a coarser neighbour, as the other two have its siblings: so there are at most six
/// edges of rims for each leaf.
TessellationBound bound_of(std::uint64_t leaves, std::uint64_t faces, std::uint64_t max_triangles) {
  constexpr std::uint64_t kLeafBytes = sizeof(Leaf);
  constexpr std::uint64_t kVertexBytes = sizeof(SurfacePlace) + sizeof(SurfaceKey) + 5 * sizeof(std::uint32_t);
  constexpr std::uint64_t kFaceBytes = 2 * sizeof(Box3), kOtherBytes = 4u << 20;
  const std::uint64_t corners = 2 * faces + 5 * (leaves - std::min(leaves, faces)) / 3;
  const std::uint64_t triangles = std::min(6 * leaves, max_triangles);
  return {.leaves = leaves,
          .most = {.vertices = corners + leaves, .triangles = triangles},
          .scratch_bytes = leaves * kLeafBytes + corners * kVertexBytes + faces * kFaceBytes + kOtherBytes};
}

/// First all leaves with their vertices, then the triangles leaf by leaf.
class Tessellator {
 public:
  Tessellator(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options)
      : halver_(solid, placement, options),
        evaluator_(solid),
        vertices_(surface_),
        mirrored_(placement.linear().determinant() < 0),
        options_(options),
        channels_(solid.channel_count()) {}

  void collect(const TessellationBound& bound);
  TessellationSummary emit(const std::function<void(const TessellationChunk&)>& deliver);
  // For the halver.
  void halved(const SurfaceBox& box) { vertices_.enter_middles(box); }
  void leaf(const SurfaceBox& box, const std::array<Vec3, 4>& corners, const Vec3& middle);

 private:
  void emit_leaf(const Leaf& leaf);
  void emit_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  std::uint32_t number_of(std::uint32_t vertex);
  std::uint32_t emit_vertex(const SurfacePlace& place);
  void read_rim(const Leaf& leaf);

  FaceHalver halver_;
  const BoundarySurface& surface_ = halver_.surface();
  LimitEvaluator evaluator_;
  SurfaceVertices vertices_;
  bool mirrored_;
  const TessellationOptions& options_;
  std::vector<Leaf> leaves_;
  std::vector<SurfacePlace> places_;    // By vertex.
  std::vector<std::uint32_t> numbers_;  // By vertex: its number in the output.
  std::vector<std::uint32_t> rim_;      // Vertices round the leaf at hand.
  std::vector<double> channels_;        // Channels at the vertex at hand.
  TessellationChunk chunk_;
};

template <class Visit>
void FaceHalver::halve(const IdRange<BoundaryFaceId>& faces, Visit& visit) {
  for (const BoundaryFaceId face : faces) {
    if (face % 32 == 0) options_.cancel.throw_if_cancelled();
    if (surface_.faces_and_interfaces()[face].regular) {
      halve_box(transformed(surface_.regular_patch(face), to_world_), SurfaceBox{.face = face}, visit);
    } else {
      halve_irregular(face, visit);
    }
  }
}

void Tessellator::collect(const TessellationBound& bound) {
  leaves_.reserve(bound.leaves);
  const std::uint64_t most_corners = bound.most.vertices - bound.leaves;
  vertices_.reserve(most_corners);
  places_.reserve(most_corners);
  numbers_.reserve(most_corners);
  halver_.halve_all(*this);
  TessellationSummary& whole = chunk_.whole;
  whole.vertices = vertices_.size();
  PeriodicPoll poll(options_.cancel);
  for (const Leaf& leaf : leaves_) {
    poll();
    read_rim(leaf);
    whole.triangles += rim_.size() == 4 ? 2 : rim_.size();
    if (rim_.size() != 4) ++whole.vertices;
  }
  check_count(whole.triangles, options_);
}

/// The surface that remains at the irregular vertex lies in the hull of its ring. Once that is smaller than the
/// tolerance, any triangles in it are near enough.
template <class Visit>
void FaceHalver::halve_irregular(BoundaryFaceId face, Visit& visit) {
  surface_.irregular_corner(face, corner_);
  SurfaceBox box{.face = face};
  std::array<Vec3, 4> corners;
  while (true) {
    Box3 hull;
    for (const PaddedPoint& point : corner_.ring) hull.extend(to_world_(point.head<3>()));
    const bool small = hull.diagonal().norm() <= options_.tolerance_mm || box.size <= kSmallestBox;
    const Vec3 origin = to_world_(surface_.corner_position(corner_));
    std::array<BezierPatch, 3> patches;
    surface_.split(corner_, patches);
    const BezierNet east = transformed(patches[0], to_world_);
    const BezierNet north = transformed(patches[1], to_world_);
    const BezierNet north_east = transformed(patches[2], to_world_);
    const Vec3 middle = corner_of(north_east, 0);
    if (small) {
      return visit.leaf(box, {origin, corner_of(east, 1), corner_of(north_east, 2), corner_of(north, 3)}, middle);
    }
    visit.halved(box);
    halve_box(east, box.quarter(1, 0), visit);
    halve_box(north, box.quarter(0, 1), visit);
    halve_box(north_east, box.quarter(1, 1), visit);
    box = box.quarter(0, 0);
  }
}

template <class Visit>
void FaceHalver::halve_box(const BezierNet& net, const SurfaceBox& box, Visit& visit) {
  if (box.size <= kSmallestBox || chord_bound(net).whole() <= options_.tolerance_mm) {
    const Vec3 middle(evaluate_middle(net.x), evaluate_middle(net.y), evaluate_middle(net.z));
    return visit.leaf(box, {corner_of(net, 0), corner_of(net, 1), corner_of(net, 2), corner_of(net, 3)}, middle);
  }
  visit.halved(box);
  const std::array<BezierNet, 4> children = quarters_of(net);
  for (int quarter = 0; quarter < 4; ++quarter) {
    halve_box(children[static_cast<std::size_t>(quarter)], box.quarter(quarter % 2, quarter / 2), visit);
  }
}

void Tessellator::leaf(const SurfaceBox& box, const std::array<Vec3, 4>& corners, const Vec3& middle) {
  if (leaves_.size() % kPiecesPerPoll == 0) options_.cancel.throw_if_cancelled();
  leaves_.push_back({box, middle});
  check_count(2 * leaves_.size(), options_);
  for (int k = 0; k < 4; ++k) {
    const auto [s, t] = box.corner(k);
    const std::uint32_t vertex = vertices_.insert(box.face, s, t).first;
    places_.resize(vertices_.size(), SurfacePlace{.face = BoundaryFaceId{kNoNumber}});
    if (places_[vertex].face == kNoNumber) places_[vertex] = {box.face, s, t, corners[k]};
  }
}

TessellationSummary Tessellator::emit(const std::function<void(const TessellationChunk&)>& deliver) {
  numbers_.assign(vertices_.size(), kNoNumber);
  TessellationSummary summary;
  const auto flush = [&] {
    const auto delivered = static_cast<std::uint32_t>(chunk_.positions.size());
    summary.vertices += delivered;
    summary.triangles += chunk_.triangles.size();
    deliver(chunk_);
    chunk_ = {.whole = chunk_.whole,
              .first_vertex = chunk_.first_vertex + delivered,
              .positions = {},
              .at = {},
              .channel_values = {},
              .triangles = {}};
  };
  for (const Leaf& leaf : leaves_) {
    emit_leaf(leaf);
    if (chunk_.triangles.size() < options_.chunk_triangles) continue;
    options_.cancel.throw_if_cancelled();
    flush();
  }
  if (!chunk_.triangles.empty()) flush();
  return summary;
}

void Tessellator::read_rim(const Leaf& leaf) {
  rim_.clear();
  vertices_.walk_rim(leaf.box, [&](int, const RimVertex& from, const RimVertex&) { rim_.push_back(from.id); });
}

void Tessellator::emit_leaf(const Leaf& leaf) {
  read_rim(leaf);
  for (std::uint32_t& vertex : rim_) vertex = number_of(vertex);
  if (rim_.size() == 4) {
    emit_triangle(rim_[0], rim_[1], rim_[2]);
    emit_triangle(rim_[0], rim_[2], rim_[3]);
    return;
  }
  // Finer neighbours have put vertices on the rim. A fan around the middle takes them all, so that no crack is left.
  const std::uint32_t half = leaf.box.size / 2;
  const std::uint32_t middle = emit_vertex({leaf.box.face, leaf.box.s + half, leaf.box.t + half, leaf.middle});
  for (std::size_t k = 0; k < rim_.size(); ++k) emit_triangle(middle, rim_[k], rim_[(k + 1) % rim_.size()]);
}

void Tessellator::emit_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (mirrored_) std::swap(b, c);
  chunk_.triangles.push_back({a, b, c});
}

std::uint32_t Tessellator::number_of(std::uint32_t vertex) {
  if (numbers_[vertex] == kNoNumber) numbers_[vertex] = emit_vertex(places_[vertex]);
  return numbers_[vertex];
}

std::uint32_t Tessellator::emit_vertex(const SurfacePlace& place) {
  constexpr double kUnit = 1.0 / kSurfaceOne;
  const CellParam at = surface_.cell_param(place.face, place.s * kUnit, place.t * kUnit);
  if (!channels_.empty()) evaluator_.mat(at, channels_);
  chunk_.positions.push_back(place.position);
  chunk_.at.push_back(at);
  for (const double value : channels_) chunk_.channel_values.push_back(static_cast<float>(value));
  return chunk_.first_vertex + static_cast<std::uint32_t>(chunk_.positions.size()) - 1;
}

}  // namespace

void visit_leaves(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                  const IdRange<BoundaryFaceId>& faces, const std::function<void(const std::array<Vec3, 4>&)>& visit) {
  require_tolerance(options);
  LeafVisit leaves{options, visit};
  FaceHalver(solid, placement, options).halve(faces, leaves);
}

TessellationBound bound_tessellation(const LimitSolid& solid, const Placement& placement,
                                     const TessellationOptions& options) {
  require_tolerance(options);
  FaceHalver halver(solid, placement, options);
  LeafCount count{options};
  halver.halve_all(count);
  return bound_of(count.leaves, halver.surface().faces().size(), options.max_triangles);
}

TessellationSummary tessellate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                               const std::function<void(const TessellationChunk&)>& deliver) {
  return tessellate(solid, placement, options, bound_tessellation(solid, placement, options), deliver);
}

TessellationSummary tessellate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                               const TessellationBound& bound,
                               const std::function<void(const TessellationChunk&)>& deliver) {
  Tessellator tessellator(solid, placement, options);
  tessellator.collect(bound);
  return tessellator.emit(deliver);
}

}  // namespace ccslice
