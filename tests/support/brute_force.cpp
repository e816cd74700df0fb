// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/brute_force.h"

#include <algorithm>
#include <limits>

#include "tests/support/brute_force_rules.h"

namespace ccslice::oracle {
namespace {

int local_edge(CellKind kind, int a, int b) {
  const auto& edges = tables(kind).edges;
  const auto at = std::ranges::find_if(edges, [&](const auto& e) {
    return e == std::array{a, b} || e == std::array{b, a};
  });
  return static_cast<int>(at - edges.begin());
}

int local_face(CellKind kind, int a, int b, int c) {
  const auto& faces = tables(kind).faces;
  const auto at = std::ranges::find_if(faces, [&](const std::vector<int>& face) {
    return std::ranges::all_of(std::array{a, b, c}, [&](int x) { return std::ranges::find(face, x) != face.end(); });
  });
  return static_cast<int>(at - faces.begin());
}

/// A point of a refined cell: the item of the cell that it belongs to.
struct ItemOfCell {
  enum Kind { kVertex, kEdge, kFace, kCell } kind;
  int local;
};

/// The point that lies from `corner` half-way towards its neighbours `towards`: none of them the vertex point, one an
/// edge point, two a face point, three the cell point.
ItemOfCell item_of(CellKind kind, int corner, const std::vector<int>& towards) {
  switch (towards.size()) {
    case 0: return {ItemOfCell::kVertex, corner};
    case 1: return {ItemOfCell::kEdge, local_edge(kind, corner, towards[0])};
    case 2: return {ItemOfCell::kFace, local_face(kind, corner, towards[0], towards[1])};
    default: return {ItemOfCell::kCell, 0};
  }
}

/// item_of() for the children of a hex: [child's corner bits in the parent][bits in the child].
using HexChildItems = std::array<std::array<ItemOfCell, 8>, 8>;

HexChildItems make_hex_child_items() {
  HexChildItems items{};
  for (int at = 0; at < 8; ++at) {
    for (int b = 0; b < 8; ++b) {
      std::vector<int> towards;
      for (int d = 0; d < 3; ++d) {
        if ((b ^ at) >> d & 1) towards.push_back(kVtkCorner[at ^ (1 << d)]);
      }
      items[at][b] = item_of(CellKind::kHex, kVtkCorner[at], towards);
    }
  }
  return items;
}

/// Ids of a cell's items in the refined mesh.
struct ChildPoints {
  const BruteCell& cell;
  std::uint32_t cell_id;
  const BruteTopology& topology;
  std::uint32_t edge_base, face_base, cell_base;

  std::uint32_t at(const ItemOfCell& item) const {
    switch (item.kind) {
      case ItemOfCell::kVertex: return cell.v[item.local];
      case ItemOfCell::kEdge: return edge_base + topology.cell_edges[cell_id][item.local];
      case ItemOfCell::kFace: return face_base + topology.cell_faces[cell_id][item.local];
      default: return cell_base + cell_id;
    }
  }
};

std::vector<int> neighbours(CellKind kind, int corner) {
  std::vector<int> result;
  for (const auto& [a, b] : tables(kind).edges) {
    if (a == corner) result.push_back(b);
    if (b == corner) result.push_back(a);
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// The child of a hex at corner bits `at`: the half-box there, with the parent's axes.
BruteCell hex_child(const ChildPoints& points, int at) {
  static const HexChildItems items = make_hex_child_items();
  BruteCell child;
  child.from = points.cell.from;
  child.from.level += 1;
  for (int d = 0; d < 3; ++d) {
    child.from.ijk[d] = 2 * points.cell.from.ijk[d] + (at >> d & 1);
    child.boundary_faces |= points.cell.boundary_faces & (1u << (2 * d + (at >> d & 1)));
  }
  for (int b = 0; b < 8; ++b) child.v[kVtkCorner[b]] = points.at(items[at][b]);
  return child;
}

/// The child of a tet or wedge at a corner: origin at the corner, axes along its three edges in right-handed order that
/// starts at the lowest-numbered neighbour.
BruteCell corner_child(const ChildPoints& points, const BruteMesh& mesh, int corner) {
  std::vector<int> axes = neighbours(points.cell.kind, corner);
  const Vec3 origin = mesh.position(points.cell.v[corner]);
  const auto to = [&](int i) -> Vec3 { return mesh.position(points.cell.v[axes[i]]) - origin; };
  if (to(0).cross(to(1)).dot(to(2)) < 0) std::swap(axes[1], axes[2]);
  BruteCell child;
  child.from.control_cell = points.cell.from.control_cell;
  child.from.child = corner;
  for (int b = 0; b < 8; ++b) {
    std::vector<int> towards;
    for (int d = 0; d < 3; ++d) {
      if (b >> d & 1) towards.push_back(axes[d]);
    }
    child.v[kVtkCorner[b]] = points.at(item_of(points.cell.kind, corner, towards));
  }
  for (int d = 0; d < 3; ++d) {  // The child's face d=0 is a part of the parent's face along the two other axes.
    const int parent_face = local_face(points.cell.kind, corner, axes[(d + 1) % 3], axes[(d + 2) % 3]);
    if (points.cell.boundary_faces >> parent_face & 1) child.boundary_faces |= 1u << (2 * d);
  }
  return child;
}

void sort_unique(std::vector<std::uint32_t>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

std::span<const std::uint32_t> corners_of(const BruteCell& cell) {
  return {cell.v.data(), static_cast<std::size_t>(corner_count(cell.kind))};
}

/// Faces with one cell are the boundary of a whole mesh.
void mark_boundary(BruteMesh& mesh) {
  for (const BruteFace& face : build_topology(mesh.cells, mesh.vertex_count()).faces) {
    if (face.cells[1] == kNone) mesh.cells[face.cells[0]].boundary_faces |= 1u << face.first_local;
  }
}

void split_sharp_edges(const BruteMesh& mesh, const BruteTopology& topology, BruteMesh& fine) {
  const auto edge_base = static_cast<std::uint32_t>(mesh.vertex_count());
  if (mesh.sharp_edges.empty()) return;
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    if (!mesh.sharp_edges.contains(topology.edges[e])) continue;
    for (const std::uint32_t v : topology.edges[e]) fine.sharp_edges.insert({v, edge_base + e});
  }
}

}  // namespace

BruteMesh to_brute_mesh(const ControlMesh& mesh) {
  BruteMesh result;
  const auto channels = mesh.channel_count();
  result.stride = static_cast<int>(3 + channels);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    for (int d = 0; d < 3; ++d) result.points.push_back(mesh.positions[v][d]);
    for (std::size_t c = 0; c < channels; ++c) result.points.push_back(mesh.channel_values[v * channels + c]);
  }
  std::size_t next = 0;
  for (std::uint32_t c = 0; c < mesh.cell_count(); ++c) {
    BruteCell cell;
    cell.kind = mesh.cell_kinds[c];
    cell.from.control_cell = c;
    for (int i = 0; i < corner_count(cell.kind); ++i) cell.v[i] = mesh.cell_vertices[next++];
    result.cells.push_back(cell);
  }
  mark_boundary(result);
  for (auto [a, b] : mesh.sharp_edges) result.sharp_edges.insert({std::min(a, b), std::max(a, b)});
  result.sharp_vertices.insert(mesh.sharp_vertices.begin(), mesh.sharp_vertices.end());
  return result;
}

Refined refine(const BruteMesh& mesh, const BruteTopology& topology) {
  Refined fine;
  fine.mesh.stride = mesh.stride;
  fine.mesh.points = refined_points(mesh, topology);
  fine.mesh.sharp_vertices = mesh.sharp_vertices;
  split_sharp_edges(mesh, topology, fine.mesh);
  const auto edge_base = static_cast<std::uint32_t>(mesh.vertex_count());
  const auto face_base = edge_base + static_cast<std::uint32_t>(topology.edges.size());
  const auto cell_base = face_base + static_cast<std::uint32_t>(topology.faces.size());
  for (std::uint32_t c = 0; c < mesh.cells.size(); ++c) {
    const BruteCell& cell = mesh.cells[c];
    const ChildPoints points{cell, c, topology, edge_base, face_base, cell_base};
    fine.first_child.push_back(static_cast<std::uint32_t>(fine.mesh.cells.size()));
    for (int i = 0; i < corner_count(cell.kind); ++i) {
      fine.mesh.cells.push_back(cell.kind == CellKind::kHex ? hex_child(points, i) : corner_child(points, mesh, i));
    }
  }
  return fine;
}

std::vector<std::uint32_t> cells_round(const BruteMesh& mesh, std::span<const std::uint32_t> vertices) {
  std::vector<std::uint32_t> cells;
  for (std::uint32_t c = 0; c < mesh.cells.size(); ++c) {
    const std::span<const std::uint32_t> corners = corners_of(mesh.cells[c]);
    if (std::ranges::find_first_of(corners, vertices) != corners.end()) cells.push_back(c);
  }
  return cells;
}

std::vector<std::uint32_t> cells_round(const BruteTopology& topology, std::span<const std::uint32_t> vertices) {
  std::vector<std::uint32_t> cells;
  for (const std::uint32_t v : vertices) {
    cells.insert(cells.end(), topology.vertex_cells[v].begin(), topology.vertex_cells[v].end());
  }
  sort_unique(cells);
  return cells;
}

std::uint32_t CutOut::vertex(std::uint32_t old) const {
  return static_cast<std::uint32_t>(std::ranges::lower_bound(vertices, old) - vertices.begin());
}

CutOut cut_out(const BruteMesh& mesh, std::span<const std::uint32_t> cells) {
  CutOut part;
  for (const std::uint32_t c : cells) {
    const BruteCell& cell = mesh.cells[c];
    part.vertices.insert(part.vertices.end(), cell.v.begin(), cell.v.begin() + corner_count(cell.kind));
  }
  sort_unique(part.vertices);
  part.mesh.stride = mesh.stride;
  for (const std::uint32_t v : part.vertices) {
    part.mesh.points.insert(part.mesh.points.end(), mesh.points.begin() + std::ptrdiff_t{v} * mesh.stride,
                            mesh.points.begin() + (std::ptrdiff_t{v} + 1) * mesh.stride);
    if (mesh.sharp_vertices.contains(v)) part.mesh.sharp_vertices.insert(part.vertex(v));
    for (auto e = mesh.sharp_edges.lower_bound({v, 0}); e != mesh.sharp_edges.end() && (*e)[0] == v; ++e) {
      if (std::ranges::binary_search(part.vertices, (*e)[1])) {
        part.mesh.sharp_edges.insert({part.vertex(v), part.vertex((*e)[1])});
      }
    }
  }
  for (const std::uint32_t c : cells) {
    BruteCell cell = mesh.cells[c];
    for (int i = 0; i < corner_count(cell.kind); ++i) cell.v[i] = part.vertex(cell.v[i]);
    part.mesh.cells.push_back(cell);
  }
  return part;
}

OneRing::OneRing(const BruteMesh& mesh, const std::vector<std::uint32_t>& cells, std::uint32_t focus)
    : mesh_(cut_out(mesh, cells).mesh),
      topology_(build_topology(mesh_.cells, mesh_.vertex_count())),
      focus_(static_cast<std::uint32_t>(std::ranges::lower_bound(cells, focus) - cells.begin())) {}

OneRing::OneRing(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t focus)
    : OneRing(mesh, cells_round(topology, corners_of(mesh.cells[focus])), focus) {}

OneRing OneRing::child(int i) const {
  const Refined fine = refine(mesh_, topology_);
  const std::uint32_t focus = fine.first_child[focus_] + i;
  return OneRing(fine.mesh, cells_round(fine.mesh, corners_of(fine.mesh.cells[focus])), focus);
}

PointValue OneRing::limit_at_centre() const { return child(0).limit_at_corner(kVtkCorner[7]); }

}  // namespace ccslice::oracle
