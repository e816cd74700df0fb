// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/tessellate.h"

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

/// First all leaves with their vertices, then the triangles leaf by leaf.
class Tessellator {
 public:
  Tessellator(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options)
      : surface_(solid),
        evaluator_(solid),
        vertices_(surface_),
        to_world_{placement.linear(), placement.translation()},
        mirrored_(placement.linear().determinant() < 0),
        options_(options),
        channels_(solid.channel_count()) {}

  void collect();
  TessellationSummary emit(const std::function<void(const TessellationChunk&)>& deliver);

 private:
  void collect_irregular(BoundaryFaceId face);
  void collect_box(const BezierNet& net, const SurfaceBox& box);
  void add(const SurfaceBox& box, const std::array<Vec3, 4>& corners, const Vec3& middle);
  void check_count(std::uint64_t triangles) const;
  void emit_leaf(const Leaf& leaf);
  void emit_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  std::uint32_t number_of(std::uint32_t vertex);
  std::uint32_t emit_vertex(const SurfacePlace& place);
  void read_rim(const Leaf& leaf);

  BoundarySurface surface_;
  LimitEvaluator evaluator_;
  SurfaceVertices vertices_;
  AffineMap to_world_;
  bool mirrored_;
  const TessellationOptions& options_;
  std::vector<Leaf> leaves_;
  std::vector<SurfacePlace> places_;    // By vertex.
  std::vector<std::uint32_t> numbers_;  // By vertex: its number in the output.
  std::vector<std::uint32_t> rim_;      // Vertices round the leaf at hand.
  std::vector<double> channels_;        // Channels at the vertex at hand.
  TessellationChunk chunk_;
  IrregularCorner corner_;
};

void Tessellator::collect() {
  for (const BoundaryFaceId face : surface_.face_ids()) {
    if (face % 32 == 0) options_.cancel.throw_if_cancelled();
    if (surface_.faces()[face].regular) {
      collect_box(transformed(surface_.regular_patch(face), to_world_), SurfaceBox{.face = face});
    } else {
      collect_irregular(face);
    }
  }
  std::uint64_t triangles = 0;
  PeriodicPoll poll(options_.cancel);
  for (const Leaf& leaf : leaves_) {
    poll();
    read_rim(leaf);
    triangles += rim_.size() == 4 ? 2 : rim_.size();
  }
  check_count(triangles);
}

/// The surface that remains at the irregular vertex lies in the hull of its ring. Once that is smaller than the
/// tolerance, any triangles in it are near enough.
void Tessellator::collect_irregular(BoundaryFaceId face) {
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
    if (small) return add(box, {origin, corner_of(east, 1), corner_of(north_east, 2), corner_of(north, 3)}, middle);
    vertices_.enter_middles(box);
    collect_box(east, box.quarter(1, 0));
    collect_box(north, box.quarter(0, 1));
    collect_box(north_east, box.quarter(1, 1));
    box = box.quarter(0, 0);
  }
}

void Tessellator::collect_box(const BezierNet& net, const SurfaceBox& box) {
  if (box.size <= kSmallestBox || chord_bound(net).whole() <= options_.tolerance_mm) {
    const Vec3 middle(evaluate_middle(net.x), evaluate_middle(net.y), evaluate_middle(net.z));
    return add(box, {corner_of(net, 0), corner_of(net, 1), corner_of(net, 2), corner_of(net, 3)}, middle);
  }
  vertices_.enter_middles(box);
  const std::array<BezierNet, 4> children = quarters_of(net);
  for (int quarter = 0; quarter < 4; ++quarter) {
    collect_box(children[static_cast<std::size_t>(quarter)], box.quarter(quarter % 2, quarter / 2));
  }
}

void Tessellator::add(const SurfaceBox& box, const std::array<Vec3, 4>& corners, const Vec3& middle) {
  if (leaves_.size() % kPiecesPerPoll == 0) options_.cancel.throw_if_cancelled();
  leaves_.push_back({box, middle});
  check_count(2 * leaves_.size());
  for (int k = 0; k < 4; ++k) {
    const auto [s, t] = box.corner(k);
    const std::uint32_t vertex = vertices_.insert(box.face, s, t).first;
    places_.resize(vertices_.size(), SurfacePlace{.face = BoundaryFaceId{kNoNumber}});
    if (places_[vertex].face == kNoNumber) places_[vertex] = {box.face, s, t, corners[k]};
  }
}

void Tessellator::check_count(std::uint64_t triangles) const {
  if (triangles <= options_.max_triangles) return;
  throw Error(ErrorCode::kTooManyTriangles,
              "chord_tolerance_mm is so small that the boundary takes more than " +
                  std::to_string(options_.max_triangles) + " triangles; choose a larger one",
              "chord_tolerance_mm");
}

TessellationSummary Tessellator::emit(const std::function<void(const TessellationChunk&)>& deliver) {
  numbers_.assign(vertices_.size(), kNoNumber);
  TessellationSummary summary;
  const auto flush = [&] {
    const auto delivered = static_cast<std::uint32_t>(chunk_.positions.size());
    summary.vertices += delivered;
    summary.triangles += chunk_.triangles.size();
    deliver(chunk_);
    chunk_ = {.first_vertex = chunk_.first_vertex + delivered,
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

TessellationSummary tessellate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                               const std::function<void(const TessellationChunk&)>& deliver) {
  if (!(options.tolerance_mm > 0) || !std::isfinite(options.tolerance_mm)) {
    throw Error(ErrorCode::kToleranceInvalid, "chord_tolerance_mm must be positive and finite", "chord_tolerance_mm");
  }
  Tessellator tessellator(solid, placement, options);
  tessellator.collect();
  return tessellator.emit(deliver);
}

}  // namespace ccslice
