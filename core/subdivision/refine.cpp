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

/// Numbers the child vertices that are needed: those of the parent's items that touch a complete vertex.
struct ChildVertices {
  std::vector<VertexId> of_vertex, of_edge, of_face, of_cell;
  std::vector<std::uint32_t> origin;
  std::array<std::uint32_t, 3> begins{};  // Where edge, face and cell points begin.

  ChildVertices(const CellComplex& parent, const std::vector<std::uint8_t>& keep) {
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
  }

  std::uint32_t count() const { return static_cast<std::uint32_t>(origin.size()); }

 private:
  template <typename Ids, typename Wanted>
  void number(std::vector<VertexId>& children, Ids items, Wanted wanted) {
    children.assign(items.size(), VertexId{kNone});
    for (const auto item : items) {
      if (!wanted(item)) continue;
      children[item] = VertexId{count()};
      origin.push_back(item);
    }
  }
};

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

/// Both halves of a sharp edge are sharp, at every level.
SharpFeatures inherit_sharp_features(const CellComplex& parent, const ChildVertices& ids) {
  SharpFeatures sharp;
  for (const EdgeId e : parent.edges()) {
    if (!parent.edge_sharp(e) || ids.of_edge[e] == kNone) continue;
    for (const VertexId v : parent.edge_vertices(e)) {
      if (ids.of_vertex[v] != kNone) sharp.edges.push_back({ids.of_vertex[v], ids.of_edge[e]});
    }
  }
  for (const VertexId v : parent.vertices()) {
    if (parent.vertex_sharp(v) && ids.of_vertex[v] != kNone) sharp.vertices.push_back(ids.of_vertex[v]);
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

Stencils make_stencils(const CellComplex& parent, const ChildVertices& ids, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Stencils stencils;
  RuleRow row(parent);
  for (std::uint32_t i = 0; i < ids.count(); ++i) {
    poll();
    const std::uint32_t origin = ids.origin[i];
    if (i < ids.begins[0]) {
      row.add_vertex_point(VertexId{origin});
    } else if (i < ids.begins[1]) {
      row.add_edge_point(EdgeId{origin});
    } else if (i < ids.begins[2]) {
      row.add_face_point(FaceId{origin});
    } else {
      row.add_cell_point(CellId{origin});
    }
    row.flush(stencils);
  }
  return stencils;
}

}  // namespace

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
  PeriodicPoll poll(cancel);
  // A child belongs to a corner of its parent. All children at the vertices of `cells` are made, so that around those
  // that are asked for none is missing.
  std::vector<std::uint8_t> keep(parent.vertex_count(), 0);
  for (const CellId c : cells) {
    for (const VertexId v : parent.cell_vertices(c)) keep[v] = 1;
  }
  ChildVertices ids(parent, keep);
  std::vector<CellId> first_child;
  std::vector<VertexId> corners;
  std::uint32_t children = 0;
  std::size_t next = 0;
  for (const CellId c : parent.cells()) {
    poll();
    if (next < cells.size() && cells[next] == c) {
      first_child.emplace_back(children);
      ++next;
    }
    const auto vertices = parent.cell_vertices(c);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (!keep[vertices[i]]) continue;
      const auto child = child_at(parent, ids, c, i);
      corners.insert(corners.end(), child.begin(), child.end());
      ++children;
    }
  }
  const SharpFeatures sharp = inherit_sharp_features(parent, ids);
  return {CellComplex(ids.count(), std::vector<CellKind>(children, CellKind::kHex), std::move(corners), sharp.edges,
                      sharp.vertices, cancel),
          make_stencils(parent, ids, cancel),
          std::move(first_child),
          ids.begins[0],
          ids.begins[1],
          ids.begins[2],
          std::move(ids.origin)};
}

}  // namespace ccslice
