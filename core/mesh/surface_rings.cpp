// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/surface_rings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "core/mesh/cell_regions.h"

namespace ccslice {
namespace {

/// A side of a ring: which edge it is, and whether the ring runs from its lesser vertex to the other.
struct Side {
  std::array<std::uint32_t, 2> edge;
  std::uint32_t ring;
  bool ascends;
};

std::span<const std::uint32_t> corners_of(const FaceVertices& ring) {
  return std::span(ring).first(ring[3] == kNone ? 3 : 4);
}

/// Faces of the boundary are numbered first, then interfaces.
const FaceVertices& ring_of(const SurfaceRings& rings, std::uint32_t number) {
  const std::size_t inside = rings.boundary.size();
  return number < inside ? rings.boundary[number] : rings.interfaces[number - inside];
}

std::vector<Side> sides_of(const SurfaceRings& rings) {
  std::vector<Side> sides;
  const std::size_t count = rings.boundary.size() + rings.interfaces.size();
  sides.reserve(4 * count);
  for (std::uint32_t ring = 0; ring < count; ++ring) {
    const auto corners = corners_of(ring_of(rings, ring));
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t from = corners[i], to = corners[(i + 1) % corners.size()];
      sides.push_back({{std::min(from, to), std::max(from, to)}, ring, from < to});
    }
  }
  std::ranges::sort(sides, {}, [](const Side& side) { return std::pair(side.edge, side.ring); });
  return sides;
}

/// The vector area, outward; zero for degenerate faces.
Vec3 vector_area(const FaceVertices& ring, const PlaceOfVertex& place) {
  const auto corners = corners_of(ring);
  Vec3 area = Vec3::Zero();
  const Vec3 first = place(corners[0]);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    area += 0.5 * (place(corners[i]) - first).cross(place(corners[i + 1]) - first);
  }
  return area;
}

/// Nothing if a face has no normal.
std::optional<double> turn_deg(const SurfaceRings& rings, const Side& side, const Side& other,
                               const PlaceOfVertex& place) {
  const Vec3 first = vector_area(ring_of(rings, side.ring), place);
  const Vec3 second = vector_area(ring_of(rings, other.ring), place);
  if (!(first.squaredNorm() > 0) || !(second.squaredNorm() > 0)) return std::nullopt;
  const Vec3 direction = (place(side.edge[1]) - place(side.edge[0])) * (side.ascends ? 1 : -1);
  const Vec3 bend = first.cross(second);
  const double angle = std::atan2(bend.norm(), first.dot(second)) * 180 / std::numbers::pi;
  return bend.dot(direction) < 0 ? -angle : angle;
}

}  // namespace

SurfaceRings surface_rings(const ControlMesh& mesh, const CellComplex& complex) {
  SurfaceRings rings;
  for (const FaceId face : complex.faces()) {
    FaceVertices ring;
    ring.fill(kNone);
    const auto corners = complex.face_vertices(face);
    std::ranges::copy(corners, ring.begin());
    if (complex.face_on_boundary(face)) {
      rings.boundary.push_back(ring);
      continue;
    }
    const auto half_faces = half_faces_of(face);
    const std::uint8_t here = region_of(mesh, complex.half_face_cell(half_faces[0]));
    const std::uint8_t beyond = region_of(mesh, complex.half_face_cell(half_faces[1]));
    if (here == beyond) continue;
    if (here > beyond) std::reverse(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(corners.size()));
    rings.interfaces.push_back(ring);
  }
  return rings;
}

std::vector<SurfaceTurn> surface_turns(const SurfaceRings& rings, const PlaceOfVertex& place, double least_deg) {
  constexpr double kRoundingDeg = 1e-6;  // So that 90 finds a box's edges.
  const std::vector<Side> sides = sides_of(rings);
  std::vector<SurfaceTurn> turns;
  for (auto begin = sides.begin(); begin != sides.end();) {
    const auto end = std::find_if(begin, sides.end(), [&](const Side& side) { return side.edge != begin->edge; });
    if (end - begin == 2) {
      const std::optional<double> turn = turn_deg(rings, *begin, *std::next(begin), place);
      const bool on_interface = begin->ring >= rings.boundary.size();
      if (turn && std::abs(*turn) >= least_deg - kRoundingDeg) turns.push_back({begin->edge, *turn, on_interface});
    }
    begin = end;
  }
  return turns;
}

}  // namespace ccslice
