// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/validate.h"

#include <algorithm>
#include <set>
#include <span>
#include <string>

#include "core/base/contains.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/check_arrays.h"
#include "core/mesh/offenders.h"

namespace ccslice {

namespace {

/// Walks small graphs of cells. Keeps its memory.
class Walk {
 public:
  /// Counts the cells that are reached from the first. neighbours(cell, visit) visits those of one cell.
  template <typename Neighbours>
  std::size_t reachable(std::span<const CellId> cells, Neighbours neighbours) {
    seen_.assign(1, cells.front());
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      neighbours(seen_[i], [&](CellId next) {
        if (!contains(seen_, next)) seen_.push_back(next);
      });
    }
    return seen_.size();
  }

 private:
  std::vector<CellId> seen_;  // In the order of the walk.
};

/// Visits the cells across those of a cell's faces that pass `through`.
template <typename Through, typename Visit>
void cells_across(const CellComplex& complex, CellId cell, Through through, Visit visit) {
  for (const HalfFaceId h : complex.cell_half_faces(cell)) {
    const CellId other = complex.half_face_cell(opposite(h));
    if (other != kNone && through(face_of(h))) visit(other);
  }
}

void check_shared_faces(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  std::vector<CellId> others;
  for (const CellId c : complex.cells()) {
    poll();
    others.clear();
    cells_across(
        complex, c, [](FaceId) { return true; }, [&](CellId o) { others.push_back(o); });
    std::sort(others.begin(), others.end());
    const auto twice = std::adjacent_find(others.begin(), others.end());
    if (twice == others.end()) continue;
    throw Error(ErrorCode::kMeshSharedFaces,
                "cells " + std::to_string(c) + " and " + std::to_string(*twice) +
                    " share more than one face: the edge between those faces has valence 2; merge the cells or remesh",
                "cell_vertices", {c, *twice});
  }
}

bool edge_is_manifold(const CellComplex& complex, EdgeId edge, Walk& walk) {
  const auto faces = complex.edge_faces(edge);
  const auto boundary =
      std::count_if(faces.begin(), faces.end(), [&](FaceId f) { return complex.face_on_boundary(f); });
  if (boundary != 0 && boundary != 2) return false;
  const auto through = [&](FaceId f) { return contains(faces, f); };
  return walk.reachable(complex.edge_cells(edge), [&](CellId c, auto visit) {
    cells_across(complex, c, through, visit);
  }) == complex.edge_cells(edge).size();
}

void check_edges(const CellComplex& complex, const MeshLimits& limits, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Walk walk;
  for (const EdgeId e : complex.edges()) {
    poll();
    const auto refuse = [&](ErrorCode code, const std::string& why) {
      const auto [a, b] = complex.edge_vertices(e);
      throw Error(code, "edge " + std::to_string(a) + "-" + std::to_string(b) + " " + why, "cell_vertices", {a, b});
    };
    if (!edge_is_manifold(complex, e, walk)) {
      refuse(ErrorCode::kMeshNonManifoldEdge,
             "isn't manifold: its cells must form one ring, or one fan between two boundary faces; separate the parts "
             "or fill the gap");
    }
    const std::size_t valence = complex.edge_cells(e).size();
    if (!complex.edge_on_boundary(e) && valence < 3) {
      refuse(ErrorCode::kMeshSharedFaces,
             "lies inside with only " + std::to_string(valence) + " cells round it; merge them or remesh");
    }
    if (valence > limits.max_edge_valence) {
      refuse(ErrorCode::kMeshValenceTooHigh,
             "has " + std::to_string(valence) + " cells round it; the limit is " +
                 std::to_string(limits.max_edge_valence) +
                 ": mesh the part with a core of some cells there, where the fan comes to a line");
    }
  }
}

/// One ball or one half-ball: the link is connected and its Euler characteristic that of a sphere or a disc.
bool vertex_is_manifold(const CellComplex& complex, VertexId vertex, Walk& walk) {
  const auto cells = complex.vertex_cells(vertex);
  const auto faces = complex.vertex_faces(vertex);
  const auto through = [&](FaceId f) { return contains(complex.face_vertices(f), vertex); };
  if (walk.reachable(cells, [&](CellId c, auto visit) { cells_across(complex, c, through, visit); }) != cells.size()) {
    return false;
  }
  const auto euler = static_cast<std::ptrdiff_t>(complex.vertex_edges(vertex).size()) -
                     static_cast<std::ptrdiff_t>(faces.size()) + static_cast<std::ptrdiff_t>(cells.size());
  return euler == (complex.vertex_on_boundary(vertex) ? 1 : 2);
}

void check_vertices(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders pinched;
  Walk walk;
  for (const VertexId v : complex.vertices()) {
    poll();
    if (!vertex_is_manifold(complex, v, walk)) pinched.add(v);
  }
  pinched.throw_if_any(ErrorCode::kMeshNonManifoldVertex, "the cells form neither one ball nor one half-ball at",
                       kVertices, "parts that touch in a point or along an edge must be separated or joined by faces",
                       "cell_vertices");
}

/// Det of the three edge vectors at a corner; hexahedra's corners are bits, where odd corners mirror.
double corner_determinant(const ControlMesh& mesh, const CellComplex& complex, CellId cell, std::size_t corner) {
  const auto vertices = complex.cell_vertices(cell);
  const auto& neighbours = cell_topology(complex.kind(cell)).corner_neighbours[corner];
  const Vec3& p = mesh.positions[vertices[corner]];
  Mat3 edges;
  for (int i = 0; i < 3; ++i) edges.col(i) = mesh.positions[vertices[neighbours[static_cast<std::size_t>(i)]]] - p;
  const bool mirrored =
      complex.kind(cell) == CellKind::kHex && (corner == 1 || corner == 2 || corner == 4 || corner == 7);
  return mirrored ? -edges.determinant() : edges.determinant();
}

/// Mirrors a cell's corner order in VTK numbering.
void mirror(CellKind kind, std::uint32_t* corners) {
  if (kind == CellKind::kTet) {
    std::swap(corners[1], corners[2]);
    return;
  }
  const int half = corner_count(kind) / 2;
  std::swap_ranges(corners, corners + half, corners + half);
}

/// True if the second cell of an interior face lists the face's vertices against the order of the first.
bool sides_oppose(const CellComplex& complex, FaceId face) {
  const auto ring = complex.face_vertices(face);
  const CellId cell = complex.half_face_cell(half_faces_of(face)[1]);
  const LocalFace& shape = cell_topology(complex.kind(cell)).faces[complex.half_face_local(half_faces_of(face)[1])];
  std::size_t first = 0;
  while (complex.cell_vertices(cell)[shape.corners[first]] != ring[0]) ++first;
  return complex.cell_vertices(cell)[shape.corners[(first + 1) % shape.size]] == ring[ring.size() - 1];
}

/// Adds the cells on both sides of faces that, once `mirrored` is applied, have both cells on the same side.
void find_overlapping_neighbours(const CellComplex& complex, const std::vector<std::uint8_t>& mirrored,
                                 std::vector<std::uint32_t>& inverted) {
  for (const FaceId f : complex.faces()) {
    if (complex.face_on_boundary(f)) continue;
    const auto [first, second] = half_faces_of(f);
    const CellId a = complex.half_face_cell(first), b = complex.half_face_cell(second);
    if (sides_oppose(complex, f) == (mirrored[a] == mirrored[b])) continue;
    inverted.insert(inverted.end(), {a, b});
  }
  std::sort(inverted.begin(), inverted.end());
  inverted.erase(std::unique(inverted.begin(), inverted.end()), inverted.end());
}

struct Orientation {
  std::vector<std::uint32_t> inverted;  // Cells with negative corners, and neighbours on the same side of their face.
  bool corrected = false;               // Cells whose corners were all negative.
};

Orientation orient(ControlMesh& mesh, const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Orientation found;
  std::vector<std::uint32_t>& inverted = found.inverted;
  std::vector<std::uint8_t> mirrored(complex.cell_count(), 0);
  std::vector<std::uint32_t> corners = mesh.cell_vertices;
  std::size_t begin = 0;
  for (const CellId c : complex.cells()) {
    if (mesh.interpolating) break;
    poll();
    const auto n = complex.cell_vertices(c).size();
    std::size_t negative = 0, positive = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double det = corner_determinant(mesh, complex, c, i);
      negative += det < 0;
      positive += det > 0;
    }
    if (negative == n) {
      mirror(complex.kind(c), &corners[begin]);
      mirrored[c] = 1;
      found.corrected = true;
    } else if (positive != n) {
      inverted.push_back(c);
    }
    begin += n;
  }
  find_overlapping_neighbours(complex, mirrored, inverted);
  if (inverted.empty() || mesh.allow_folds) mesh.cell_vertices = std::move(corners);
  return found;
}

void check_sharp_edges(const ControlMesh& mesh, const CellComplex& complex) {
  std::set<EdgeId> seen;
  for (std::size_t i = 0; i < mesh.sharp_edges.size(); ++i) {
    const auto [a, b] = mesh.sharp_edges[i];
    const auto refuse = [a = a, b = b, i](const std::string& what) {
      throw Error(ErrorCode::kMeshBadSharpFeature,
                  "sharp edge " + std::to_string(a) + "-" + std::to_string(b) + " " + what,
                  "sharp_edges[" + std::to_string(2 * i) + "]", {std::min(a, b), std::max(a, b)});
    };
    const EdgeId e = complex.find_edge(VertexId{a}, VertexId{b});
    const std::string rule = ": only edges on the boundary or on an interface of cell regions can be sharp";
    if (e == kNone) refuse("isn't an edge of any cell" + rule);
    if (!complex.edge_on_boundary(e) && !edge_on_interface(mesh, complex, e)) refuse("lies inside the solid" + rule);
    if (!seen.insert(e).second) refuse("is given twice: name each once");
  }
}

void check_sharp_vertices(const ControlMesh& mesh, const CellComplex& complex) {
  std::set<VertexId> seen;
  for (std::size_t i = 0; i < mesh.sharp_vertices.size(); ++i) {
    const VertexId v{mesh.sharp_vertices[i]};
    const auto refuse = [v, i](const std::string& what) {
      throw Error(ErrorCode::kMeshBadSharpFeature, "sharp vertex " + std::to_string(v) + " " + what,
                  "sharp_vertices[" + std::to_string(i) + "]", {v});
    };
    if (!complex.vertex_on_boundary(v) && !vertex_on_interface(mesh, complex, v)) {
      refuse("lies inside the solid: only vertices on the boundary or on an interface of cell regions can be sharp");
    }
    if (!seen.insert(v).second) refuse("is given twice: name each once");
  }
}

/// Each is of something that there is, and they ascend.
void check_mid_nodes(const ControlMesh& mesh, const CellComplex& complex) {
  const MidNodes& nodes = mesh.mid_nodes;
  const std::uint32_t vertices = complex.vertex_count();
  const auto check = [](const auto& keys, const char* field, auto exists) {
    Offenders unknown, late;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (!exists(keys[i])) unknown.add(static_cast<std::int64_t>(i));
      if (i > 0 && !(keys[i - 1] < keys[i])) late.add(static_cast<std::int64_t>(i));
    }
    unknown.throw_if_any(ErrorCode::kMeshBadMidNode, "there is no such edge, quadrilateral or hexahedron for",
                         kMidNodes, "each lies on one of a cell's, by its vertices in ascending order", field);
    late.throw_if_any(ErrorCode::kMeshBadMidNode, "again or too late:", kMidNodes,
                      "list them in ascending order, each once", field);
  };
  check(nodes.edges, "edge_node_vertices", [&](const std::array<std::uint32_t, 2>& edge) {
    return edge[0] < edge[1] && edge[1] < vertices && complex.find_edge(VertexId{edge[0]}, VertexId{edge[1]}) != kNone;
  });
  check(nodes.faces, "face_node_vertices", [&](const std::array<std::uint32_t, 4>& face) {
    if (!std::ranges::is_sorted(face) || face[3] >= vertices) return false;
    return std::ranges::any_of(complex.vertex_faces(VertexId{face[0]}), [&](FaceId f) {
      const auto ring = complex.face_vertices(f);
      return ring.size() == 4 &&
             std::ranges::all_of(face, [&](std::uint32_t v) { return contains(ring, VertexId{v}); });
    });
  });
  check(nodes.cells, "cell_node_cells", [&](std::uint32_t cell) {
    return cell < complex.cell_count() && complex.kind(CellId{cell}) == CellKind::kHex;
  });
}

}  // namespace

MeshReport validate(ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  return validate_and_connect(mesh, limits, cancel).report;
}

ConnectedMesh validate_and_connect(ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  check_arrays(mesh, limits, cancel);
  CellComplex complex = make_cell_complex(mesh, cancel);
  check_shared_faces(complex, cancel);
  check_edges(complex, limits, cancel);
  check_vertices(complex, cancel);
  check_sharp_edges(mesh, complex);
  check_sharp_vertices(mesh, complex);
  check_mid_nodes(mesh, complex);
  Orientation found = orient(mesh, complex, cancel);
  if (!mesh.allow_folds) {
    Offenders inverted;
    for (const std::uint32_t c : found.inverted) inverted.add(c);
    inverted.throw_if_any(ErrorCode::kMeshInvertedCell,
                          "a corner of non-positive Jacobian, or a neighbour on the same side of a face, in", kCells,
                          "untangle them, or set allow_folds to slice the solid as it is", "cell_vertices");
  }
  if (found.corrected) {
    { const CellComplex released = std::move(complex); }  // Lest two are held at once.
    complex = make_cell_complex(mesh, cancel);
  }
  return {{std::move(found.inverted)}, std::move(complex)};
}

}  // namespace ccslice
