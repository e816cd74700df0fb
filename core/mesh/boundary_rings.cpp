// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/boundary_rings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

namespace ccslice {
namespace {

/// A side of a ring: which edge it is, and whether the ring runs from its lesser vertex to the other.
struct Side {
  std::array<std::uint32_t, 2> edge;
  std::uint32_t ring;
  bool ascends;
};

std::span<const std::uint32_t> corners_of(const std::array<std::uint32_t, 4>& ring) {
  return std::span(ring).first(ring[3] == kNone ? 3 : 4);
}

std::vector<Side> sides_of(const BoundaryRings& rings) {
  std::vector<Side> sides;
  sides.reserve(4 * rings.size());
  for (std::uint32_t ring = 0; ring < rings.size(); ++ring) {
    const auto corners = corners_of(rings[ring]);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t from = corners[i], to = corners[(i + 1) % corners.size()];
      sides.push_back({{std::min(from, to), std::max(from, to)}, ring, from < to});
    }
  }
  std::ranges::sort(sides, {}, [](const Side& side) { return std::pair(side.edge, side.ring); });
  return sides;
}

/// The vector area, outward; zero for degenerate faces.
Vec3 vector_area(const std::array<std::uint32_t, 4>& ring, const PlaceOfVertex& place) {
  const auto corners = corners_of(ring);
  Vec3 area = Vec3::Zero();
  const Vec3 first = place(corners[0]);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    area += 0.5 * (place(corners[i]) - first).cross(place(corners[i + 1]) - first);
  }
  return area;
}

/// Nothing if a face has no normal.
std::optional<double> turn_deg(const BoundaryRings& rings, const Side& side, const Side& other,
                               const PlaceOfVertex& place) {
  const Vec3 first = vector_area(rings[side.ring], place), second = vector_area(rings[other.ring], place);
  if (!(first.squaredNorm() > 0) || !(second.squaredNorm() > 0)) return std::nullopt;
  const Vec3 direction = (place(side.edge[1]) - place(side.edge[0])) * (side.ascends ? 1 : -1);
  const Vec3 bend = first.cross(second);
  const double angle = std::atan2(bend.norm(), first.dot(second)) * 180 / std::numbers::pi;
  return bend.dot(direction) < 0 ? -angle : angle;
}

}  // namespace

BoundaryRings boundary_rings(const CellComplex& complex) {
  BoundaryRings rings;
  for (const FaceId face : complex.faces()) {
    if (!complex.face_on_boundary(face)) continue;
    std::array<std::uint32_t, 4>& ring = rings.emplace_back();
    ring.fill(kNone);
    std::ranges::copy(complex.face_vertices(face), ring.begin());
  }
  return rings;
}

std::vector<SurfaceTurn> surface_turns(const BoundaryRings& rings, const PlaceOfVertex& place, double least_deg) {
  constexpr double kRoundingDeg = 1e-6;  // So that 90 finds a box's edges.
  const std::vector<Side> sides = sides_of(rings);
  std::vector<SurfaceTurn> turns;
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].edge != sides[i + 1].edge) continue;
    const std::optional<double> turn = turn_deg(rings, sides[i], sides[i + 1], place);
    if (turn && std::abs(*turn) >= least_deg - kRoundingDeg) turns.push_back({sides[i].edge, *turn});
  }
  return turns;
}

}  // namespace ccslice
