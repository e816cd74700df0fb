// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/surface_ring.h"

#include <algorithm>

#include "core/base/error.h"

namespace ccslice {

namespace {

constexpr std::array<unsigned, 4> kCycleBits = {0, 1, 3, 2};  // Corner bits counter-clockwise.

}  // namespace

SurfaceWalker::SurfaceWalker(const CellComplex& complex) : complex_(complex), local_(complex.vertex_count(), kNone) {}

SurfaceWalker::Framed SurfaceWalker::framed(FaceId face, std::uint8_t start) const {
  const auto cycle = complex_.face_vertices(face);
  Framed result{face, {}};
  for (unsigned i = 0; i < 4; ++i) result.vertices[kCycleBits[i]] = cycle[(start + i) % 4];
  return result;
}

EdgeId SurfaceWalker::side_edge(const Framed& at, unsigned axis, unsigned side) const {
  const unsigned base = side << axis;
  return complex_.find_edge(at.vertices[base], at.vertices[base | 1u << (1 - axis)]);
}

FaceId SurfaceWalker::other_face(EdgeId edge, FaceId face) const {
  for (const FaceId f : complex_.edge_faces(edge)) {
    if (f != face && complex_.face_on_boundary(f)) return f;
  }
  throw Error(ErrorCode::kInternal, "a boundary edge has only one boundary face");
}

SurfaceWalker::Framed SurfaceWalker::cross(const Framed& from, unsigned axis, unsigned side) const {
  const FaceId next = other_face(side_edge(from, axis, side), from.face);
  const auto cycle = complex_.face_vertices(next);
  // As in rings of cells, shared vertices keep their bits, and the far ones get the opposite bit along the axis.
  const unsigned near = side << axis, far = (1 - side) << axis, along = 1u << (1 - axis);
  Framed result{next, {}};
  for (const unsigned bit : {0u, along}) {
    const VertexId shared = from.vertices[near | bit], partner = from.vertices[near | (bit ^ along)];
    const auto i = static_cast<std::size_t>(std::find(cycle.begin(), cycle.end(), shared) - cycle.begin());
    const VertexId after = cycle[(i + 1) % 4], before = cycle[(i + 3) % 4];
    result.vertices[near | bit] = shared;
    result.vertices[far | bit] = after == partner ? before : after;
  }
  return result;
}

bool SurfaceWalker::corner_regular(FaceId face, unsigned corner) const {
  const auto cycle = complex_.face_vertices(face);
  const VertexId v = cycle[corner];
  std::size_t valence = 0, sharp = 0;
  for (const EdgeId e : complex_.vertex_edges(v)) {
    if (!complex_.edge_on_boundary(e)) continue;
    ++valence;
    sharp += complex_.edge_sharp(e);
  }
  const std::array<EdgeId, 2> sides = {complex_.find_edge(v, cycle[(corner + 1) % 4]),
                                       complex_.find_edge(v, cycle[(corner + 3) % 4])};
  const bool first = complex_.edge_sharp(sides[0]), second = complex_.edge_sharp(sides[1]);
  // A phantom layer P(-1) = 2 P(0) - P(1) makes of the B-spline's rule (1, 6, 1) / 8 the rule P(0) across a side.
  // Across two sides the corner stays where it is; across one the crease's own rule is left.
  if (sharp > 2 || complex_.vertex_sharp(v)) return first && second;
  if (sharp == 0) return valence == 4;
  if (sharp != 2 || first == second) return false;
  // A crease along one side: the face across the other side must end at the crease too.
  const EdgeId smooth = sides[first ? 1 : 0];
  const auto next = complex_.face_vertices(other_face(smooth, face));
  for (std::size_t i = 0; i < 4; ++i) {
    if (next[i] != v) continue;
    const EdgeId a = complex_.find_edge(v, next[(i + 1) % 4]), b = complex_.find_edge(v, next[(i + 3) % 4]);
    return complex_.edge_sharp(a == smooth ? b : a);
  }
  return false;
}

SurfaceRing SurfaceWalker::walk(FaceId face) {
  if (complex_.as_meshed()) return regular_ring(face);
  unsigned count = 0;
  std::uint8_t start = 0;
  for (std::uint8_t i = 0; i < 4; ++i) {
    if (corner_regular(face, i)) continue;
    start = i;
    ++count;
  }
  if (count > 1) throw Error(ErrorCode::kInternal, "a boundary face has two irregular corners");
  return count == 0 ? regular_ring(face) : irregular_ring(face, start);
}

SurfaceRing SurfaceWalker::regular_ring(FaceId face) const {
  SurfaceRing ring;
  ring.points.assign(16, VertexId{kNone});
  const Framed start = framed(face, 0);
  for (unsigned side = 0; side < 4; ++side) {
    const bool sharp = complex_.as_meshed() || complex_.edge_sharp(side_edge(start, side / 2, side & 1));
    ring.phantoms |= static_cast<PhantomMask>(sharp << side);
  }
  const auto open = [&](unsigned axis, int d) { return d == 0 || !(ring.phantoms >> (2 * axis + (d > 0)) & 1); };
  const auto step = [&](const Framed& at, unsigned axis, int d) {
    return d == 0 ? at : cross(at, axis, d > 0 ? 1 : 0);
  };
  for (int dt = -1; dt <= 1; ++dt) {
    if (!open(1, dt)) continue;
    const Framed row = step(start, 1, dt);
    for (int ds = -1; ds <= 1; ++ds) {
      if (!open(0, ds)) continue;
      const Framed at = step(row, 0, ds);
      for (unsigned j = 0; j < 4; ++j) {
        ring.points[grid_index(ds, j & 1) + 4 * grid_index(dt, j >> 1)] = at.vertices[j];
      }
    }
  }
  return ring;
}

SurfaceRing SurfaceWalker::irregular_ring(FaceId face, std::uint8_t start) {
  SurfaceRing ring;
  ring.regular = false;
  ring.start = start;
  std::vector<Framed> queue{framed(face, start)};
  const auto core = queue.front().vertices;
  const auto in_core = [&](VertexId v) { return std::find(core.begin(), core.end(), v) != core.end(); };
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Framed at = queue[i];
    std::array<std::uint32_t, 4> quad{};
    for (unsigned j = 0; j < 4; ++j) {
      std::uint32_t& number = local_[at.vertices[j]];
      if (number == kNone) {
        number = static_cast<std::uint32_t>(ring.points.size());
        ring.points.push_back(at.vertices[j]);
      }
      quad[j] = number;
    }
    ring.quads.push_back(quad);
    for (unsigned side = 0; side < 4; ++side) {
      const unsigned base = (side & 1) << (side / 2);
      if (!in_core(at.vertices[base]) && !in_core(at.vertices[base | 1u << (1 - side / 2)])) continue;
      const Framed next = cross(at, side / 2, side & 1);
      const bool seen = std::any_of(queue.begin(), queue.end(), [&](const Framed& f) { return f.face == next.face; });
      if (!seen) queue.push_back(next);
    }
  }
  for (std::uint32_t j = 0; j < 4; ++j) {
    if (complex_.vertex_sharp(core[j])) ring.sharp_vertices.push_back(local_[core[j]]);
    for (const EdgeId e : complex_.vertex_edges(core[j])) {
      if (!complex_.edge_sharp(e)) continue;
      const std::uint32_t mine = local_[core[j]], other = local_[complex_.edge_other(e, core[j])];
      if (other > mine) ring.sharp_edges.push_back({mine, other});
    }
  }
  for (const VertexId v : ring.points) local_[v] = kNone;
  for (const auto& quad : ring.quads) ring.key.insert(ring.key.end(), quad.begin(), quad.end());
  append_sharp_features(ring.sharp_edges, ring.sharp_vertices, ring.key);
  return ring;
}

}  // namespace ccslice
