// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/classify.h"

#include <algorithm>

namespace ccslice {

namespace {

struct BoundaryEdges {
  std::size_t count = 0;  // The surface valence.
  std::size_t sharp = 0;
};

BoundaryEdges boundary_edges(const CellComplex& complex, VertexId vertex) {
  BoundaryEdges result;
  for (const EdgeId e : complex.vertex_edges(vertex)) {
    if (!complex.edge_on_boundary(e)) continue;
    ++result.count;
    result.sharp += complex.edge_sharp(e);
  }
  return result;
}

bool share_a_face(const CellComplex& complex, EdgeId edge_a, EdgeId edge_b) {
  const auto faces = complex.edge_faces(edge_b);
  return std::ranges::any_of(complex.edge_faces(edge_a),
                             [&](FaceId f) { return std::ranges::find(faces, f) != faces.end(); });
}

}  // namespace

bool Classifier::irregular(EdgeId edge) const {
  const std::size_t cells = complex_.edge_cells(edge).size();
  if (!complex_.edge_on_boundary(edge)) return cells != 4;
  return cells != (complex_.edge_sharp(edge) ? 1u : 2u);
}

/// Both edges have n cells, and there are no other cells at the vertex: two layers of n. Inside, n edges across the
/// line lie between these. On the boundary four edges belong to it, two of the line and two across.
bool Classifier::line_passes(VertexId vertex, EdgeId edge_a, EdgeId edge_b) const {
  const std::size_t n = complex_.edge_cells(edge_a).size();
  if (complex_.edge_cells(edge_b).size() != n || complex_.vertex_cells(vertex).size() != 2 * n) return false;
  if (share_a_face(complex_, edge_a, edge_b)) return false;  // The line turns here.
  if (!complex_.vertex_on_boundary(vertex)) return complex_.vertex_edges(vertex).size() == n + 2;
  if (!complex_.edge_on_boundary(edge_a) || !complex_.edge_on_boundary(edge_b)) return false;
  const BoundaryEdges boundary = boundary_edges(complex_, vertex);
  const bool sharp = complex_.edge_sharp(edge_a);
  return sharp == complex_.edge_sharp(edge_b) && boundary.count == 4 && boundary.sharp == (sharp ? 2u : 0u) &&
         !complex_.vertex_sharp(vertex);
}

/// One layer of n cells, whose caps bound the solid. With a phantom layer P(-1) = 2 P(0) - P(1) the B-spline's rule
/// along the line, (P(-1) + 6 P(0) + P(1)) / 8, is P(0), so that only the planar rule is left: it has to be that of the
/// caps.
bool Classifier::line_ends(VertexId vertex, EdgeId edge) const {
  if (!complex_.vertex_on_boundary(vertex)) return false;
  const std::size_t n = complex_.edge_cells(edge).size();
  if (complex_.vertex_cells(vertex).size() != n) return false;
  const BoundaryEdges boundary = boundary_edges(complex_, vertex);
  if (!complex_.edge_on_boundary(edge)) {
    return boundary.count == n && boundary.sharp == 0 && !complex_.vertex_sharp(vertex);
  }
  // n caps have n + 1 edges, and one is the line's. The outermost ones must be sharp, with one cell, as the boundary
  // along the line meets the caps there; the line itself may be sharp or not.
  const bool sharp = complex_.edge_sharp(edge);
  return boundary.count == n + 2 && boundary.sharp == (sharp ? 3u : 2u) && (sharp || !complex_.vertex_sharp(vertex));
}

Classifier::State Classifier::find_state(VertexId vertex) const {
  for (const CellId c : complex_.vertex_cells(vertex)) {
    if (complex_.kind(c) != CellKind::kHex) return State::kMixed;
  }
  std::array<EdgeId, 2> lines{};
  std::size_t count = 0;
  for (const EdgeId e : complex_.vertex_edges(vertex)) {
    if (!irregular(e)) continue;
    if (count == 2) return State::kIrregular;
    lines[count++] = e;
  }
  if (count == 0) {
    const bool corner = complex_.vertex_cells(vertex).size() == 1;
    return complex_.vertex_sharp(vertex) && !corner ? State::kIrregular : State::kRegular;
  }
  const bool straight = count == 2 ? line_passes(vertex, lines[0], lines[1]) : line_ends(vertex, lines[0]);
  return straight ? State::kOnLine : State::kIrregular;
}

Classifier::State Classifier::state(VertexId vertex) {
  State& state = vertex_state_[vertex];
  if (state == State::kUnknown) state = find_state(vertex);
  return state;
}

std::optional<Classification> Classifier::classify(CellId cell) {
  if (complex_.kind(cell) != CellKind::kHex) return std::nullopt;
  if (complex_.as_meshed()) return Classification{};
  const auto vertices = complex_.cell_vertices(cell);
  std::size_t irregular_vertices = 0, irregular_edges = 0;
  std::uint8_t corner = 0, line = 0;
  for (std::uint8_t i = 0; i < 8; ++i) {
    const State s = state(vertices[i]);
    if (s == State::kMixed) return std::nullopt;
    if (s != State::kIrregular) continue;
    corner = i;
    if (++irregular_vertices > 1) return std::nullopt;
  }
  bool all_at_corner = true;
  for (std::uint8_t e = 0; e < 12; ++e) {
    if (!irregular(complex_.cell_edges(cell)[e])) continue;
    line = e;
    ++irregular_edges;
    const auto& ends = cell_tables::kHexEdges[e];
    all_at_corner &= ends[0] == corner || ends[1] == corner;
  }
  if (irregular_vertices == 1) {
    return all_at_corner ? std::optional(Classification{CellClass::kVertex, corner}) : std::nullopt;
  }
  if (irregular_edges > 1) return std::nullopt;
  return irregular_edges == 1 ? Classification{CellClass::kLine, line} : Classification{CellClass::kRegular, 0};
}

}  // namespace ccslice
