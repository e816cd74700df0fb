// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/validate.h"

#include <algorithm>
#include <set>
#include <string>

#include "core/base/contains.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/check_arrays.h"
#include "core/mesh/corner_determinant.h"
#include "core/mesh/manifold.h"
#include "core/mesh/offenders.h"

namespace ccslice {

namespace {

/// The number of pairs and the first one are told.
void check_shared_faces(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  std::vector<CellId> others;
  std::vector<std::int64_t> first;
  std::size_t pairs = 0;
  for (const CellId c : complex.cells()) {
    poll();
    others.clear();
    cells_across(
        complex, c, [](FaceId) { return true; }, [&](CellId o) { others.push_back(o); });
    std::sort(others.begin(), others.end());
    for (auto other = std::adjacent_find(others.begin(), others.end()); other != others.end();
         other = std::adjacent_find(other, others.end())) {
      const CellId twice = *other;
      pairs += c < twice;
      if (first.empty()) first = {c, twice};
      other = std::upper_bound(other, others.end(), twice);
    }
  }
  if (pairs == 0) return;
  const std::string more = pairs == 1   ? ""
                           : pairs == 2 ? ", and so do two others"
                                        : ", and so do " + std::to_string(pairs - 1) + " more pairs";
  throw Error(ErrorCode::kMeshSharedFaces,
              "cells " + std::to_string(first[0]) + " and " + std::to_string(first[1]) +
                  " share more than one face: the edge between those faces has valence 2" + more +
                  "; merge the cells or remesh",
              "cell_vertices", first);
}

/// Collects edges that break one rule, as Offenders does ids. An error's ids are those of their vertices.
class EdgeOffenders {
 public:
  explicit EdgeOffenders(const CellComplex& complex) : complex_(complex) {}

  void add(EdgeId edge) {
    if (total_++ >= kMostNamed) return;
    const auto [a, b] = complex_.edge_vertices(edge);
    names_.push_back(std::to_string(a) + "-" + std::to_string(b));
    ids_.insert({a, b});
  }
  /// "edges 4-13, 7-16 and 5 more REST", or how that begins for one edge.
  void throw_if_any(ErrorCode code, const std::string& rest_of_one, const std::string& rest_of_many) const {
    if (total_ == 0) return;
    throw Error(code, named_things(kEdges, names_, total_) + " " + (total_ == 1 ? rest_of_one : rest_of_many),
                "cell_vertices", {ids_.begin(), ids_.end()});
  }

 private:
  static constexpr std::size_t kMostNamed = kMaxEchoItems / 2;

  const CellComplex& complex_;
  std::size_t total_ = 0;
  std::vector<std::string> names_;
  std::set<std::int64_t> ids_;
};

void check_edges(const CellComplex& complex, const MeshLimits& limits, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  ManifoldTest manifold(complex);
  EdgeOffenders pinched(complex), thin(complex), crowded(complex);
  std::size_t crowd = 0;  // Cells round the first crowded edge.
  for (const EdgeId e : complex.edges()) {
    poll();
    const std::size_t valence = complex.edge_cells(e).size();
    if (!manifold.holds_at(e)) {
      pinched.add(e);
    } else if (!complex.edge_on_boundary(e) && valence < 3) {
      thin.add(e);
    } else if (valence > limits.max_edge_valence) {
      crowded.add(e);
      if (crowd == 0) crowd = valence;
    }
  }
  const std::string rule =
      " manifold: the cells of one must form one ring, or one fan between two boundary faces; separate the parts or "
      "fill the gap";
  pinched.throw_if_any(ErrorCode::kMeshNonManifoldEdge, "isn't" + rule, "aren't" + rule);
  const std::string thin_rule = " inside with fewer than 3 cells round it; merge them or remesh";
  thin.throw_if_any(ErrorCode::kMeshSharedFaces, "lies" + thin_rule, "lie each" + thin_rule);
  const std::string limit = std::to_string(limits.max_edge_valence) +
                            ": mesh the part with a core of some cells there, where the fan comes to a line";
  crowded.throw_if_any(ErrorCode::kMeshValenceTooHigh,
                       "has " + std::to_string(crowd) + " cells round it; the limit is " + limit,
                       "have more cells round them than the limit of " + limit);
}

void check_vertices(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders pinched;
  ManifoldTest manifold(complex);
  for (const VertexId v : complex.vertices()) {
    poll();
    if (!manifold.holds_at(v)) pinched.add(v);
  }
  pinched.throw_if_any(ErrorCode::kMeshNonManifoldVertex, "the cells form neither one ball nor one half-ball at",
                       kVertices, "parts that touch in a point or along an edge must be separated or joined by faces",
                       "cell_vertices");
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
    const auto place = [&](std::size_t corner) { return mesh.positions[complex.cell_vertices(c)[corner]]; };
    for (std::size_t i = 0; i < n; ++i) {
      const double det = corner_determinant(complex.kind(c), i, place);
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

/// Each lies on an edge or a quadrilateral that there is.
void check_mid_nodes(const ControlMesh& mesh, const CellComplex& complex) {
  const auto check = [](const auto& keys, const char* field, auto exists) {
    Offenders unknown;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (!exists(keys[i])) unknown.add(static_cast<std::int64_t>(i));
    }
    unknown.throw_if_any(ErrorCode::kMeshBadMidNode, "there is no such edge or quadrilateral for", kMidNodes,
                         "each lies on one of a cell's", field);
  };
  check(mesh.mid_nodes.edges, "edge_node_vertices", [&](const std::array<std::uint32_t, 2>& edge) {
    return complex.find_edge(VertexId{edge[0]}, VertexId{edge[1]}) != kNone;
  });
  check(mesh.mid_nodes.faces, "face_node_vertices", [&](const std::array<std::uint32_t, 4>& face) {
    return std::ranges::any_of(complex.vertex_faces(VertexId{face[0]}), [&](FaceId f) {
      const auto ring = complex.face_vertices(f);
      return ring.size() == 4 &&
             std::ranges::all_of(face, [&](std::uint32_t v) { return contains(ring, VertexId{v}); });
    });
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
  if (mesh.as_meshed) check_mid_nodes(mesh, complex);
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
