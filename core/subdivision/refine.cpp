// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refine.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/contains.h"

namespace ccslice {

namespace {

/// Sums weighted means of cells, faces, edges and vertices of the parent into one row.
class Row {
 public:
  explicit Row(const CellComplex& parent) : parent_(parent), weight_(parent.vertex_count(), 0.0) {}

  void add_vertex(VertexId v, double weight) {
    if (weight == 0) return;
    touched_.push_back(v);
    weight_[v] += weight;
  }
  void add_mean(std::span<const VertexId> vertices, double weight) {
    for (const VertexId v : vertices) add_vertex(v, weight / static_cast<double>(vertices.size()));
  }
  void add_cell(CellId c, double weight) { add_mean(parent_.cell_vertices(c), weight); }
  void add_face(FaceId f, double weight) { add_mean(parent_.face_vertices(f), weight); }
  void add_edge(EdgeId e, double weight) { add_mean(parent_.edge_vertices(e), weight); }
  void add_cells(std::span<const CellId> cells, double weight) {
    for (const CellId c : cells) add_cell(c, weight / static_cast<double>(cells.size()));
  }
  void add_faces(std::span<const FaceId> faces, double weight) {
    for (const FaceId f : faces) add_face(f, weight / static_cast<double>(faces.size()));
  }
  void add_edges(std::span<const EdgeId> edges, double weight) {
    for (const EdgeId e : edges) add_edge(e, weight / static_cast<double>(edges.size()));
  }

  /// Appends the row, indices ascending, and starts the next one.
  void flush(Stencils& stencils) {
    std::sort(touched_.begin(), touched_.end());
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    entries_.clear();
    for (const VertexId v : touched_) entries_.emplace_back(v, std::exchange(weight_[v], 0.0));
    stencils.append(entries_);
    touched_.clear();
  }

 private:
  const CellComplex& parent_;
  std::vector<double> weight_;
  std::vector<VertexId> touched_;
  std::vector<std::pair<std::uint32_t, double>> entries_;
};

template <typename Ids, typename Keep>
std::vector<typename Ids::value_type> select(const Ids& ids, Keep keep) {
  std::vector<typename Ids::value_type> result;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(result), keep);
  return result;
}

bool is_extraordinary(const CellComplex& complex, EdgeId edge) {
  return !complex.edge_on_boundary(edge) && complex.edge_cells(edge).size() != 4;
}

void face_point(const CellComplex& parent, FaceId face, Row& row) {
  if (parent.face_on_boundary(face)) {
    row.add_face(face, 1);
    return;
  }
  const auto [first, second] = half_faces_of(face);
  row.add_cell(parent.half_face_cell(first), 0.25);
  row.add_face(face, 0.5);
  row.add_cell(parent.half_face_cell(second), 0.25);
}

void edge_point(const CellComplex& parent, EdgeId edge, Row& row) {
  if (!parent.edge_on_boundary(edge)) {
    const auto n = static_cast<double>(parent.edge_cells(edge).size());
    row.add_cells(parent.edge_cells(edge), 1 / n);
    row.add_faces(parent.edge_faces(edge), 2 / n);
    row.add_edge(edge, (n - 3) / n);
  } else if (parent.edge_sharp(edge)) {
    row.add_edge(edge, 1);
  } else {
    row.add_edge(edge, 0.5);
    row.add_faces(select(parent.edge_faces(edge), [&](FaceId f) { return parent.face_on_boundary(f); }), 0.5);
  }
}

void boundary_vertex_point(const CellComplex& parent, VertexId vertex, Row& row) {
  const auto edges = select(parent.vertex_edges(vertex), [&](EdgeId e) { return parent.edge_on_boundary(e); });
  const auto sharp = select(edges, [&](EdgeId e) { return parent.edge_sharp(e); });
  if (sharp.size() > 2 || parent.vertex_sharp(vertex)) {
    row.add_vertex(vertex, 1);
  } else if (sharp.size() == 2) {
    row.add_vertex(vertex, 0.75);
    for (const EdgeId e : sharp) row.add_vertex(parent.edge_other(e, vertex), 0.125);
  } else {
    const auto k = static_cast<double>(edges.size());
    row.add_faces(select(parent.vertex_faces(vertex), [&](FaceId f) { return parent.face_on_boundary(f); }), 1 / k);
    row.add_edges(edges, 2 / k);
    row.add_vertex(vertex, (k - 3) / k);
  }
}

void straight_vertex_point(const CellComplex& parent, VertexId vertex, Row& row) {
  const auto along = select(parent.vertex_edges(vertex), [&](EdgeId e) { return is_extraordinary(parent, e); });
  const auto across = select(parent.vertex_edges(vertex), [&](EdgeId e) { return !is_extraordinary(parent, e); });
  const auto n = static_cast<double>(parent.edge_cells(along.front()).size());
  const auto on_line = [&](FaceId f) {
    return std::any_of(along.begin(), along.end(), [&](EdgeId e) {
      const auto faces = parent.edge_faces(e);
      return std::find(faces.begin(), faces.end(), f) != faces.end();
    });
  };
  const auto faces = parent.vertex_faces(vertex);
  row.add_cells(parent.vertex_cells(vertex), 0.5 / n);
  row.add_faces(select(faces, [&](FaceId f) { return !on_line(f); }), 0.5 / n);
  row.add_faces(select(faces, on_line), 1 / n);
  row.add_edges(across, 1 / n);
  row.add_edges(along, (n - 3) / (2 * n));
  row.add_vertex(vertex, (n - 3) / (2 * n));
}

void vertex_point(const CellComplex& parent, VertexId vertex, Row& row) {
  if (parent.vertex_on_boundary(vertex)) {
    boundary_vertex_point(parent, vertex, row);
  } else if (on_straight_extraordinary_edge(parent, vertex)) {
    straight_vertex_point(parent, vertex, row);
  } else {
    row.add_cells(parent.vertex_cells(vertex), 0.125);
    row.add_faces(parent.vertex_faces(vertex), 0.375);
    row.add_edges(parent.vertex_edges(vertex), 0.375);
    row.add_vertex(vertex, 0.125);
  }
}

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
  Row row(parent);
  for (std::uint32_t i = 0; i < ids.count(); ++i) {
    poll();
    const std::uint32_t origin = ids.origin[i];
    if (i < ids.begins[0]) {
      vertex_point(parent, VertexId{origin}, row);
    } else if (i < ids.begins[1]) {
      edge_point(parent, EdgeId{origin}, row);
    } else if (i < ids.begins[2]) {
      face_point(parent, FaceId{origin}, row);
    } else {
      row.add_cell(CellId{origin}, 1);
    }
    row.flush(stencils);
  }
  return stencils;
}

}  // namespace

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

Stencils refine_star(const CellComplex& star, VertexId vertex) {
  enum class Joint : std::uint8_t { kVertex, kEdge, kFace, kCell };
  std::vector<std::pair<Joint, std::uint32_t>> joints(star.vertex_count(), {Joint::kVertex, vertex});
  for (const EdgeId e : star.vertex_edges(vertex)) joints[star.edge_other(e, vertex)] = {Joint::kEdge, e};
  for (const FaceId f : star.vertex_faces(vertex)) joints[opposite_in_face(star, f, vertex)] = {Joint::kFace, f};
  for (const CellId c : star.vertex_cells(vertex)) joints[opposite_in_cell(star, c, vertex)] = {Joint::kCell, c};
  Stencils stencils;
  Row row(star);
  for (const auto& [joint, id] : joints) {
    switch (joint) {
      case Joint::kVertex: vertex_point(star, vertex, row); break;
      case Joint::kEdge: edge_point(star, EdgeId{id}, row); break;
      case Joint::kFace: face_point(star, FaceId{id}, row); break;
      case Joint::kCell: row.add_cell(CellId{id}, 1); break;
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
