// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refine_rules.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "core/base/contains.h"

namespace ccslice {

namespace {

template <typename Ids, typename Keep>
std::vector<typename Ids::value_type> select(const Ids& ids, Keep keep) {
  std::vector<typename Ids::value_type> result;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(result), keep);
  return result;
}

}  // namespace

bool is_extraordinary(const CellComplex& complex, EdgeId edge) {
  return !complex.edge_on_boundary(edge) && complex.edge_cells(edge).size() != 4;
}

bool on_straight_extraordinary_edge(const CellComplex& complex, VertexId vertex) {
  if (complex.vertex_on_boundary(vertex)) return false;
  std::array<std::size_t, 2> valence{};
  std::size_t count = 0;
  for (const EdgeId e : complex.vertex_edges(vertex)) {
    if (!is_extraordinary(complex, e)) continue;
    if (count == 2) return false;
    valence[count++] = complex.edge_cells(e).size();
  }
  return count == 2 && valence[0] == valence[1] && complex.vertex_cells(vertex).size() == 2 * valence[0] &&
         complex.vertex_edges(vertex).size() == valence[0] + 2;
}

void RuleRow::add_vertex(VertexId vertex, double weight) {
  if (weight == 0) return;
  if (weight_[vertex] == 0) touched_.push_back(vertex);  // Not each time: fewer have to be sorted.
  weight_[vertex] += weight;
}

void RuleRow::add_mean(std::span<const VertexId> vertices, double weight) {
  for (const VertexId v : vertices) add_vertex(v, weight / static_cast<double>(vertices.size()));
}

void RuleRow::add_cells(std::span<const CellId> cells, double weight) {
  for (const CellId c : cells) add_cell(c, weight / static_cast<double>(cells.size()));
}

void RuleRow::add_faces(std::span<const FaceId> faces, double weight) {
  for (const FaceId f : faces) add_face(f, weight / static_cast<double>(faces.size()));
}

void RuleRow::add_edges(std::span<const EdgeId> edges, double weight) {
  for (const EdgeId e : edges) add_edge(e, weight / static_cast<double>(edges.size()));
}

void RuleRow::flush(Stencils& stencils) {
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  entries_.clear();
  for (const VertexId v : touched_) entries_.emplace_back(v, std::exchange(weight_[v], 0.0));
  stencils.append(entries_);
  touched_.clear();
}

// The weights of every rule add up to 1, so that refinement commutes with affine maps.
void RuleRow::add_cell_point(CellId cell, double weight) { add_cell(cell, weight); }

void RuleRow::add_face_point(FaceId face, double weight) {
  if (parent_.as_meshed() || parent_.face_on_boundary(face)) {
    add_face(face, weight);
    return;
  }
  const auto [first, second] = half_faces_of(face);
  add_cell(parent_.half_face_cell(first), 0.25 * weight);
  add_face(face, 0.5 * weight);
  add_cell(parent_.half_face_cell(second), 0.25 * weight);
}

// Why a cell at a straight EE is (Catmull-Clark surface) x (cubic B-spline). Vertices there lie in layers along the EE.
// In one layer let P be the vertex on the EE, Q the mean centroid of the layer's faces at it, and R the mean midpoint
// of its edges. Catmull-Clark's rule for P is (Q + 2 R + (n-3) P) / n; those of cubic B-splines are (1, 6, 1) / 8 at a
// vertex and (1, 1) / 2 between two.
//
// An edge of the EE lies between two layers: Cbar, Abar and M are the means of their Q, R and P. So the rule for edges,
// (Cbar + 2 Abar + (n-3) M) / n, already is Catmull-Clark's times (1, 1) / 2.
//
// At a vertex of the EE, in layer 0 between the layers - and +,
//
//   Cbar + Ah = (Q- + 6 Q0 + Q+) / 4,    Av + Mh = (R- + 6 R0 + R+) / 4,    Mv + P = (P- + 6 P0 + P+) / 4.
//
// So [Cbar + Ah + 2 (Av + Mh) + (n-3) (Mv + P)] / (2n) is Catmull-Clark's times (1, 6, 1) / 8. The general rule has
// 2 Av + 3n/(n+2) Mh. For (1, 6, 1) both would need the same weight, which they have for n = 4 only: elsewhere it is no
// product.
void RuleRow::add_edge_point(EdgeId edge, double weight) {
  if (parent_.as_meshed()) {
    add_edge(edge, weight);
  } else if (!parent_.edge_on_boundary(edge)) {
    const auto n = static_cast<double>(parent_.edge_cells(edge).size());
    add_cells(parent_.edge_cells(edge), 1 / n * weight);
    add_faces(parent_.edge_faces(edge), 2 / n * weight);
    add_edge(edge, (n - 3) / n * weight);
  } else if (parent_.edge_sharp(edge)) {
    add_edge(edge, weight);
  } else {
    add_edge(edge, 0.5 * weight);
    add_faces(select(parent_.edge_faces(edge), [&](FaceId f) { return parent_.face_on_boundary(f); }), 0.5 * weight);
  }
}

/// Rules of the boundary read the boundary alone. So its limit is a Catmull-Clark surface, whatever lies inside. Where
/// two sharp edges meet, (1, 6, 1) / 8 here and the midpoint on edges make of them a cubic B-spline curve. A vertex
/// where a single sharp edge ends has the rule of a smooth one.
void RuleRow::add_boundary_vertex_point(VertexId vertex, double weight) {
  const auto edges = select(parent_.vertex_edges(vertex), [&](EdgeId e) { return parent_.edge_on_boundary(e); });
  const auto sharp = select(edges, [&](EdgeId e) { return parent_.edge_sharp(e); });
  if (sharp.size() > 2 || parent_.vertex_sharp(vertex)) {
    add_vertex(vertex, weight);
  } else if (sharp.size() == 2) {
    add_vertex(vertex, 0.75 * weight);
    for (const EdgeId e : sharp) add_vertex(parent_.edge_other(e, vertex), 0.125 * weight);
  } else {
    const auto k = static_cast<double>(edges.size());
    add_faces(select(parent_.vertex_faces(vertex), [&](FaceId f) { return parent_.face_on_boundary(f); }),
              1 / k * weight);
    add_edges(edges, 2 / k * weight);
    add_vertex(vertex, (k - 3) / k * weight);
  }
}

void RuleRow::add_straight_vertex_point(VertexId vertex, double weight) {
  const auto is_along = [&](EdgeId e) { return is_extraordinary(parent_, e); };
  const auto along = select(parent_.vertex_edges(vertex), is_along);
  const auto across = select(parent_.vertex_edges(vertex), [&](EdgeId e) { return !is_along(e); });
  const auto n = static_cast<double>(parent_.edge_cells(along.front()).size());
  const auto on_line = [&](FaceId f) {
    return std::ranges::any_of(along, [&](EdgeId e) { return contains(parent_.edge_faces(e), f); });
  };
  const auto faces = parent_.vertex_faces(vertex);
  add_cells(parent_.vertex_cells(vertex), 0.5 / n * weight);
  add_faces(select(faces, [&](FaceId f) { return !on_line(f); }), 0.5 / n * weight);
  add_faces(select(faces, on_line), 1 / n * weight);
  add_edges(across, 1 / n * weight);
  add_edges(along, (n - 3) / (2 * n) * weight);
  add_vertex(vertex, (n - 3) / (2 * n) * weight);
}

void RuleRow::add_vertex_point(VertexId vertex, double weight) {
  if (parent_.as_meshed()) {
    add_vertex(vertex, weight);
  } else if (parent_.vertex_on_boundary(vertex)) {
    add_boundary_vertex_point(vertex, weight);
  } else if (on_straight_extraordinary_edge(parent_, vertex)) {
    add_straight_vertex_point(vertex, weight);
  } else {
    add_cells(parent_.vertex_cells(vertex), 0.125 * weight);
    add_faces(parent_.vertex_faces(vertex), 0.375 * weight);
    add_edges(parent_.vertex_edges(vertex), 0.375 * weight);
    add_vertex(vertex, 0.125 * weight);
  }
}

}  // namespace ccslice
