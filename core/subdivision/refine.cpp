// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refine.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/contains.h"
#include "core/subdivision/refine_rules.h"

namespace ccslice {

namespace {

FaceId face_with(const CellComplex& parent, CellId cell, const std::array<VertexId, 3>& vertices) {
  for (const HalfFaceId h : parent.cell_half_faces(cell)) {
    const auto ring = parent.face_vertices(face_of(h));
    if (std::ranges::all_of(vertices, [&](VertexId v) { return contains(ring, v); })) return face_of(h);
  }
  return FaceId{kNone};
}

/// The child of a cell at one of its corners: eight child vertices in bits order.
std::array<VertexId, 8> child_at(const CellComplex& parent, const ChildVertices& ids, CellId cell, std::size_t corner) {
  const auto vertices = parent.cell_vertices(cell);
  const bool hex = parent.kind(cell) == CellKind::kHex;
  const auto& neighbours = cell_topology(parent.kind(cell)).corner_neighbours[corner];
  const VertexId v = vertices[corner];
  std::array<VertexId, 3> ends;
  for (std::size_t i = 0; i < 3; ++i) ends[i] = vertices[neighbours[i]];
  // Local bits here count from the corner itself; a hexahedron's child keeps the parent's axes, so its bits flip.
  const std::size_t flip = hex ? corner : 0;
  std::array<VertexId, 8> child;
  child[0 ^ flip] = ids.of_vertex[v];
  for (std::size_t i = 0; i < 3; ++i) {
    child[(std::size_t{1} << i) ^ flip] = ids.of_edge[parent.find_edge(v, ends[i])];
    const std::size_t j = (i + 1) % 3;
    const FaceId face = face_with(parent, cell, {v, ends[i], ends[j]});
    child[(std::size_t{1} << i | std::size_t{1} << j) ^ flip] = ids.of_face[face];
  }
  child[7 ^ flip] = ids.of_cell[cell];
  return child;
}

struct SharpFeatures {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> vertices;
};

/// Both halves of a sharp edge are sharp, at every level. `local`: numbers of child vertices in the cut-out.
SharpFeatures inherit_sharp_features(const CellComplex& parent, const ChildVertices& children,
                                     std::span<const VertexId> kept, const std::vector<std::uint32_t>& local) {
  SharpFeatures sharp;
  for (const VertexId v : kept) {
    const std::uint32_t here = local[children.of_vertex[v]];
    if (parent.vertex_sharp(v)) sharp.vertices.push_back(here);
    for (const EdgeId e : parent.vertex_edges(v)) {
      if (parent.edge_sharp(e)) sharp.edges.push_back({here, local[children.of_edge[e]]});
    }
  }
  return sharp;
}

VertexId opposite_in_face(const CellComplex& parent, FaceId face, VertexId vertex) {
  const auto ring = parent.face_vertices(face);
  const auto at = static_cast<std::size_t>(std::find(ring.begin(), ring.end(), vertex) - ring.begin());
  return ring[(at + 2) % 4];
}

VertexId opposite_in_cell(const CellComplex& parent, CellId cell, VertexId vertex) {
  const auto corners = parent.cell_vertices(cell);
  return corners[static_cast<std::size_t>(std::find(corners.begin(), corners.end(), vertex) - corners.begin()) ^ 7u];
}

}  // namespace

template <typename Ids, typename Wanted>
void ChildVertices::number(std::vector<VertexId>& children, Ids items, Wanted wanted) {
  children.assign(items.size(), VertexId{kNone});
  for (const auto item : items) {
    if (!wanted(item)) continue;
    children[item] = VertexId{count()};
    origin.push_back(item);
  }
}

ChildVertices::ChildVertices(const CellComplex& parent, std::span<const CellId> cells) {
  origin.reserve(std::size_t{parent.vertex_count()} + parent.edge_count() + parent.face_count() + parent.cell_count());
  std::vector<std::uint8_t> keep(parent.vertex_count(), 0);
  for (const CellId c : cells) {
    for (const VertexId v : parent.cell_vertices(c)) keep[v] = 1;
  }
  const auto touches = [&](auto vertices) {
    return std::any_of(vertices.begin(), vertices.end(), [&](VertexId v) { return keep[v] != 0; });
  };
  number(of_vertex, parent.vertices(), [&](VertexId v) { return keep[v] != 0; });
  begins[0] = count();
  number(of_edge, parent.edges(), [&](EdgeId e) { return touches(parent.edge_vertices(e)); });
  begins[1] = count();
  number(of_face, parent.faces(), [&](FaceId f) { return touches(parent.face_vertices(f)); });
  begins[2] = count();
  number(of_cell, parent.cells(), [&](CellId c) { return touches(parent.cell_vertices(c)); });
  origin.shrink_to_fit();
}

Stencils ChildRules::rows(std::uint32_t first, std::uint32_t count, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Stencils stencils;
  for (std::uint32_t i = first; i < first + count; ++i) {
    poll();
    const std::uint32_t origin = children_.origin[i];
    if (i < children_.begins[0]) {
      row_.add_vertex_point(VertexId{origin});
    } else if (i < children_.begins[1]) {
      row_.add_edge_point(EdgeId{origin});
    } else if (i < children_.begins[2]) {
      row_.add_face_point(FaceId{origin});
    } else {
      row_.add_cell_point(CellId{origin});
    }
    row_.flush(stencils);
  }
  return stencils;
}

void CutOutMaker::add_children(CellId cell, std::vector<VertexId>& corners) const {
  const auto vertices = parent_.cell_vertices(cell);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!keep_[vertices[i]]) continue;
    const auto child = child_at(parent_, children_, cell, i);
    corners.insert(corners.end(), child.begin(), child.end());
  }
}

/// A child belongs to a corner of its parent. All children at the vertices of `cells` are made, so that around those
/// that are asked for none is missing.
CutOut CutOutMaker::make(std::span<const CellId> cells, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  std::vector<VertexId> kept, numbers, corners;
  std::vector<CellId> parents, first_child;
  for (const CellId c : cells) {
    for (const VertexId v : parent_.cell_vertices(c)) {
      if (std::exchange(keep_[v], std::uint8_t{1}) != 0) continue;
      kept.push_back(v);
      const auto around = parent_.vertex_cells(v);
      parents.insert(parents.end(), around.begin(), around.end());
    }
  }
  std::ranges::sort(parents);
  parents.erase(std::unique(parents.begin(), parents.end()), parents.end());
  for (std::size_t next = 0; const CellId c : parents) {
    poll();
    if (next < cells.size() && cells[next] == c) {
      first_child.emplace_back(static_cast<std::uint32_t>(corners.size() / 8));
      ++next;
    }
    add_children(c, corners);
  }
  for (const VertexId v : corners) {
    if (std::exchange(local_[v], 0) == kNone) numbers.push_back(v);
  }
  std::ranges::sort(numbers);
  for (std::uint32_t i = 0; i < numbers.size(); ++i) local_[numbers[i]] = i;
  for (VertexId& v : corners) v = VertexId{local_[v]};
  const SharpFeatures sharp = inherit_sharp_features(parent_, children_, kept, local_);
  for (const VertexId v : kept) keep_[v] = 0;
  for (const VertexId v : numbers) local_[v] = kNone;
  std::vector<CellKind> kinds(corners.size() / 8, CellKind::kHex);
  CellComplex complex(static_cast<std::uint32_t>(numbers.size()), std::move(kinds), std::move(corners), sharp.edges,
                      sharp.vertices, cancel);
  complex.take_as_meshed(parent_.as_meshed());
  return {std::move(complex), std::move(numbers), std::move(first_child)};
}

Stencils refine_star(const CellComplex& star, VertexId vertex) {
  enum class Joint : std::uint8_t { kVertex, kEdge, kFace, kCell };
  std::vector<std::pair<Joint, std::uint32_t>> joints(star.vertex_count(), {Joint::kVertex, vertex});
  for (const EdgeId e : star.vertex_edges(vertex)) joints[star.edge_other(e, vertex)] = {Joint::kEdge, e};
  for (const FaceId f : star.vertex_faces(vertex)) joints[opposite_in_face(star, f, vertex)] = {Joint::kFace, f};
  for (const CellId c : star.vertex_cells(vertex)) joints[opposite_in_cell(star, c, vertex)] = {Joint::kCell, c};
  Stencils stencils;
  RuleRow row(star);
  for (const auto& [joint, id] : joints) {
    switch (joint) {
      case Joint::kVertex: row.add_vertex_point(vertex); break;
      case Joint::kEdge: row.add_edge_point(EdgeId{id}); break;
      case Joint::kFace: row.add_face_point(FaceId{id}); break;
      case Joint::kCell: row.add_cell_point(CellId{id}); break;
    }
    row.flush(stencils);
  }
  return stencils;
}

VertexId seen_from(const CellComplex& parent, const Refinement& refined, VertexId child, VertexId vertex) {
  const std::uint32_t origin = refined.origin[child];
  if (child < refined.edge_points_begin) return VertexId{origin};
  if (child < refined.face_points_begin) return parent.edge_other(EdgeId{origin}, vertex);
  if (child < refined.cell_points_begin) return opposite_in_face(parent, FaceId{origin}, vertex);
  return opposite_in_cell(parent, CellId{origin}, vertex);
}

Refinement refine(const CellComplex& parent, std::span<const CellId> cells, const CancellationToken& cancel) {
  ChildVertices children(parent, cells);
  CutOut all = CutOutMaker(parent, children).make(cells, cancel);
  return {std::move(all.complex),     ChildRules(parent, children).rows(0, children.count(), cancel),
          std::move(all.first_child), children.begins[0],
          children.begins[1],         children.begins[2],
          std::move(children.origin)};
}

}  // namespace ccslice
