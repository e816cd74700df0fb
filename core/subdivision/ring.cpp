// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/ring.h"

#include <algorithm>

#include "core/base/contains.h"
#include "core/base/error.h"

namespace ccslice {

void append_sharp_features(std::vector<std::array<std::uint32_t, 2>>& edges, const std::vector<std::uint32_t>& vertices,
                           std::vector<std::uint32_t>& key) {
  std::sort(edges.begin(), edges.end());
  key.push_back(kNone);
  for (const auto& e : edges) key.insert(key.end(), e.begin(), e.end());
  key.push_back(kNone);
  key.insert(key.end(), vertices.begin(), vertices.end());
}

RingWalker::RingWalker(const CellComplex& complex) : complex_(complex), local_(complex.vertex_count(), kNone) {}

RingWalker::Framed RingWalker::cross(const Framed& from, unsigned a, unsigned side) const {
  const Frame& f = from.frame;
  const unsigned local_side = side ^ (f.origin >> f.axis[a] & 1u);
  const HalfFaceId half_face = complex_.cell_half_faces(from.cell)[2u * f.axis[a] + local_side];
  const CellId next = complex_.half_face_cell(opposite(half_face));
  if (next == kNone) return {next, {}};
  const auto vertices = complex_.cell_vertices(next);
  const auto corner_of = [&](unsigned framed) {
    const VertexId v = vertex_at(from, framed);
    return static_cast<unsigned>(std::find(vertices.begin(), vertices.end(), v) - vertices.begin());
  };
  const unsigned base = side << a;
  const unsigned corner = corner_of(base);
  Frame frame;
  frame.axis[a] = static_cast<std::uint8_t>(complex_.half_face_local(opposite(half_face)) / 2);
  const unsigned b = (a + 1) % 3, c = (a + 2) % 3;
  frame.axis[b] = static_cast<std::uint8_t>(std::countr_zero(corner ^ corner_of(base | 1u << b)));
  frame.axis[c] = static_cast<std::uint8_t>(3 - frame.axis[a] - frame.axis[b]);
  frame.origin = static_cast<std::uint8_t>(corner ^ side << frame.axis[a]);
  return {next, frame};
}

void RingWalker::number(VertexId vertex, std::vector<VertexId>& points) {
  if (local_[vertex] != kNone) return;
  local_[vertex] = static_cast<std::uint32_t>(points.size());
  points.push_back(vertex);
}

void RingWalker::forget(const std::vector<VertexId>& points) {
  for (const VertexId v : points) {
    if (v != kNone) local_[v] = kNone;
  }
}

RegularRing RingWalker::regular(CellId cell, const Frame& frame) const {
  RegularRing ring;
  ring.points.fill(VertexId{kNone});
  // Cells by steps (-1, 0, 1) along the three axes, reached one axis after the other.
  const auto visit = [&](const Framed& at, int du, int dv, int dw) {
    for (unsigned j = 0; j < 8; ++j) {
      const unsigned i = grid_index(du, j & 1) + 4 * grid_index(dv, j >> 1 & 1) + 16 * grid_index(dw, j >> 2);
      ring.points[i] = vertex_at(at, j);
    }
  };
  const auto step = [&](const Framed& at, unsigned axis, int d) {
    return d == 0 ? at : cross(at, axis, d > 0 ? 1 : 0);
  };
  const Framed start{cell, frame};
  for (unsigned side = 0; side < 6; ++side) {
    if (cross(start, side / 2, side & 1).cell == kNone) ring.phantoms |= static_cast<PhantomMask>(1u << side);
  }
  const auto open = [&](unsigned axis, int d) { return d == 0 || !(ring.phantoms >> (2 * axis + (d > 0)) & 1); };
  for (int dw = -1; dw <= 1; ++dw) {
    if (!open(2, dw)) continue;
    const Framed layer = step(start, 2, dw);
    for (int dv = -1; dv <= 1; ++dv) {
      if (!open(1, dv)) continue;
      const Framed row = step(layer, 1, dv);
      for (int du = -1; du <= 1; ++du) {
        if (open(0, du)) visit(step(row, 0, du), du, dv, dw);
      }
    }
  }
  return ring;
}

void RingWalker::queue_neighbours(const Framed& at, unsigned sides, std::span<const VertexId> core,
                                  std::vector<Framed>& queue) const {
  for (unsigned side = 0; side < sides; ++side) {
    const Framed next = cross(at, side / 2, side & 1);
    if (next.cell == kNone) continue;
    const auto vertices = complex_.cell_vertices(next.cell);
    const bool touches = std::any_of(core.begin(), core.end(), [&](VertexId v) { return contains(vertices, v); });
    const bool seen = std::any_of(queue.begin(), queue.end(), [&](const Framed& f) { return f.cell == next.cell; });
    if (touches && !seen) queue.push_back(next);
  }
}

LineRing RingWalker::line(CellId cell, const Frame& frame) {
  LineRing ring;
  const Framed start{cell, frame};
  std::array<VertexId, 4> core;
  for (unsigned j = 0; j < 4; ++j) core[j] = vertex_at(start, j);
  std::vector<Framed> queue{start};
  std::array<std::vector<VertexId>, 4> layers;  // Below, bottom, top, above.
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Framed at = queue[i];
    const Framed down = cross(at, 2, 0), up = cross(at, 2, 1);
    if (i == 0) ring.phantoms = static_cast<PhantomMask>((down.cell == kNone) << 4 | (up.cell == kNone) << 5);
    std::array<std::uint32_t, 4> quad{};
    for (unsigned j = 0; j < 4; ++j) {
      const VertexId v = vertex_at(at, j);
      const bool fresh = local_[v] == kNone;
      number(v, layers[1]);
      quad[j] = local_[v];
      if (!fresh) continue;
      layers[0].push_back(down.cell == kNone ? VertexId{kNone} : vertex_at(down, j | 4));
      layers[2].push_back(vertex_at(at, j | 4));
      layers[3].push_back(up.cell == kNone ? VertexId{kNone} : vertex_at(up, j));
    }
    ring.quads.push_back(quad);
    queue_neighbours(at, 4, core, queue);
  }
  forget(layers[1]);
  ring.count = static_cast<std::uint32_t>(layers[1].size());
  for (const auto& layer : layers) ring.points.insert(ring.points.end(), layer.begin(), layer.end());
  for (unsigned j = 0; j < 4; ++j) {
    const EdgeId edge = complex_.find_edge(core[j], vertex_at(start, j | 4));
    if (complex_.edge_sharp(edge)) ring.sharp_corners |= static_cast<std::uint8_t>(1u << j);
  }
  for (const auto& quad : ring.quads) ring.key.insert(ring.key.end(), quad.begin(), quad.end());
  ring.key.push_back(kNone);
  ring.key.push_back(ring.sharp_corners);
  return ring;
}

VertexRing RingWalker::vertex(CellId cell, const Frame& frame) {
  VertexRing ring;
  std::vector<Framed> queue{{cell, frame}};
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Framed at = queue[i];
    std::array<std::uint32_t, 8> numbers{};
    for (unsigned j = 0; j < 8; ++j) {
      number(vertex_at(at, j), ring.points);
      numbers[j] = local_[vertex_at(at, j)];
    }
    ring.cells.push_back(numbers);
    queue_neighbours(at, 6, complex_.cell_vertices(cell), queue);
  }
  collect_sharp_features(ring);
  forget(ring.points);
  for (const auto& c : ring.cells) ring.key.insert(ring.key.end(), c.begin(), c.end());
  append_sharp_features(ring.sharp_edges, ring.sharp_vertices, ring.key);
  return ring;
}

void RingWalker::collect_sharp_features(VertexRing& ring) const {
  for (std::uint32_t j = 0; j < 8; ++j) {
    const VertexId v = ring.points[j];
    if (complex_.vertex_sharp(v)) ring.sharp_vertices.push_back(j);
    for (const EdgeId e : complex_.vertex_edges(v)) {
      if (!complex_.edge_sharp(e)) continue;
      const std::uint32_t other = local_[complex_.edge_other(e, v)];
      if (other == kNone) throw Error(ErrorCode::kInternal, "the ring of a cell is incomplete");
      if (other > j) ring.sharp_edges.push_back({j, other});
    }
  }
}

}  // namespace ccslice
