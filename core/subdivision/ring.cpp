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

RingWalker::RingWalker(const CellComplex& complex)
    : complex_(complex),
      local_(complex.vertex_count(), kNone),
      core_(complex.vertex_count(), 0),
      seen_(complex.cell_count(), 0) {}

std::array<VertexId, 8> RingWalker::framed_vertices(const Framed& at) const {
  const auto vertices = complex_.cell_vertices(at.cell);
  std::array<VertexId, 8> framed;
  for (unsigned j = 0; j < 8; ++j) framed[j] = vertices[at.frame.corner(j)];
  return framed;
}

/// Shared corners keep their framed bits: bit a, too, which is `side` for all of them. So the next cell's other corners
/// have the opposite bit a, although they lie farther on: its axis a is mirrored. The frame follows from where it has
/// two of the shared corners, and the face between the cells.
RingWalker::Framed RingWalker::cross(const Framed& from, unsigned a, unsigned side) const {
  const HalfFaceId half_face = half_face_of(from, a, side);
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

std::array<std::uint32_t, 8> RingWalker::numbers_of(const Framed& at) const {
  std::array<std::uint32_t, 8> numbers;
  const auto vertices = framed_vertices(at);
  for (std::size_t j = 0; j < 8; ++j) numbers[j] = local_[vertices[j]];
  return numbers;
}

void RingWalker::forget(std::span<const VertexId> points) {
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
    if (complex_.as_meshed() || cross(start, side / 2, side & 1).cell == kNone)
      ring.phantoms |= static_cast<PhantomMask>(1u << side);
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

/// Breadth first, faces in the order of framed axes: the order follows from the topology and the start's frame alone,
/// so that equal neighbourhoods are numbered alike. Marks carry the number of the walk and needn't be cleared.
std::vector<RingWalker::Framed> RingWalker::walk(const Framed& start, unsigned sides, std::span<const VertexId> core) {
  ++walks_;
  for (const VertexId v : core) core_[v] = walks_;
  std::vector<Framed> cells{start};
  seen_[start.cell] = walks_;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (unsigned side = 0; side < sides; ++side) {
      // Most cells were met before; their vertices, on which a frame depends, are far away in memory.
      const CellId next = complex_.half_face_cell(opposite(half_face_of(cells[i], side / 2, side & 1)));
      if (next == kNone || seen_[next] == walks_) continue;
      seen_[next] = walks_;
      const auto vertices = complex_.cell_vertices(next);
      if (std::ranges::none_of(vertices, [&](VertexId v) { return core_[v] == walks_; })) continue;
      cells.push_back(cross(cells[i], side / 2, side & 1));
    }
  }
  return cells;
}

/// Walks across four sides only, and so stays in the cell's own layer. Across the other two lie the points below and
/// above, unless the line ends there.
LineRing RingWalker::line(CellId cell, const Frame& frame) {
  LineRing ring;
  const Framed start{cell, frame};
  std::array<VertexId, 4> core;
  for (unsigned j = 0; j < 4; ++j) core[j] = vertex_at(start, j);
  std::array<std::vector<VertexId>, 4> layers;  // Below, bottom, top, above.
  for (const Framed& at : walk(start, 4, core)) {
    const Framed down = cross(at, 2, 0), up = cross(at, 2, 1);
    if (at.cell == cell) ring.phantoms = static_cast<PhantomMask>((down.cell == kNone) << 4 | (up.cell == kNone) << 5);
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

NumberedCells RingWalker::cells_at(const Framed& start, std::span<const VertexId> core) {
  NumberedCells all;
  for (const Framed& at : walk(start, 6, core)) {
    for (const VertexId v : framed_vertices(at)) number(v, all.points);
    all.cells.push_back(numbers_of(at));
  }
  collect_sharp_features(core, all.sharp_edges, all.sharp_vertices);
  forget(all.points);
  return all;
}

VertexStar RingWalker::star(CellId cell, const Frame& frame) {
  const Framed start{cell, frame};
  VertexStar star{cells_at(start, std::array{vertex_at(start, 0)}), {}};
  for (const auto& c : star.cells) star.key.insert(star.key.end(), c.begin(), c.end());
  append_sharp_features(star.sharp_edges, star.sharp_vertices, star.key);
  return star;
}

NumberedCells RingWalker::neighbourhood(CellId cell, const Frame& frame) {
  const Framed start{cell, frame};
  return cells_at(start, framed_vertices(start));
}

VertexRing RingWalker::vertex(CellId cell, const Frame& frame, std::span<const VertexId> star) {
  VertexRing ring;
  const Framed start{cell, frame};
  const auto corners = framed_vertices(start);
  const auto cells = walk(start, 6, std::span(corners).subspan(1));
  // Numbers in the star stand in local_ until the shared points have numbers of the ring.
  for (std::size_t i = 0; i < star.size(); ++i) local_[star[i]] = static_cast<std::uint32_t>(i);
  std::vector<VertexId>& points = ring.points;
  ++walks_;
  for (const Framed& at : cells) {
    for (const VertexId v : framed_vertices(at)) {
      if (core_[v] == walks_ || local_[v] == kNone) continue;
      core_[v] = walks_;
      ring.shared.push_back(local_[v]);
      points.push_back(v);
    }
  }
  forget(star);
  for (std::size_t i = 0; i < points.size(); ++i) local_[points[i]] = static_cast<std::uint32_t>(i);
  for (const Framed& at : cells) {
    for (const VertexId v : framed_vertices(at)) number(v, points);
    ring.cells.push_back(numbers_of(at));
  }
  std::vector<std::array<std::uint32_t, 2>> sharp_edges;
  std::vector<std::uint32_t> sharp_vertices;
  collect_sharp_features(std::span(corners).subspan(1), sharp_edges, sharp_vertices);
  forget(points);
  for (const auto& c : ring.cells) ring.key.insert(ring.key.end(), c.begin(), c.end());
  append_sharp_features(sharp_edges, sharp_vertices, ring.key);
  ring.key.push_back(static_cast<std::uint32_t>(ring.shared.size()));
  return ring;
}

void RingWalker::collect_sharp_features(std::span<const VertexId> core,
                                        std::vector<std::array<std::uint32_t, 2>>& edges,
                                        std::vector<std::uint32_t>& vertices) const {
  for (const VertexId v : core) {
    const std::uint32_t here = local_[v];
    if (complex_.vertex_sharp(v)) vertices.push_back(here);
    for (const EdgeId e : complex_.vertex_edges(v)) {
      if (!complex_.edge_sharp(e)) continue;
      const std::uint32_t other = local_[complex_.edge_other(e, v)];
      if (other == kNone) throw Error(ErrorCode::kInternal, "the ring of a cell is incomplete");
      const std::array<std::uint32_t, 2> edge{std::min(here, other), std::max(here, other)};
      if (!contains(edges, edge)) edges.push_back(edge);
    }
  }
}

}  // namespace ccslice
