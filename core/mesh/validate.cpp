// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/validate.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <set>
#include <string>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"

namespace ccslice {

namespace {

constexpr std::size_t kMaxNamedIds = 8;

/// "3, 17, 22 and 5 more"
std::string list_ids(const std::vector<std::int64_t>& ids, std::size_t total) {
  std::string text;
  for (std::size_t i = 0; i < ids.size(); ++i) text += (i ? ", " : "") + std::to_string(ids[i]);
  if (total > ids.size()) text += " and " + std::to_string(total - ids.size()) + " more";
  return text;
}

/// Collects offending ids in ascending order of discovery and throws one error that names the first of them.
class Offenders {
 public:
  void add(std::int64_t id) {
    if (ids_.size() < kMaxNamedIds) ids_.push_back(id);
    ++total_;
  }
  void throw_if_any(ErrorCode code, const std::string& what, const std::string& remedy, const char* field) const {
    if (total_ == 0) return;
    throw Error(code, what + " " + list_ids(ids_, total_) + ": " + remedy, field, ids_);
  }

 private:
  std::vector<std::int64_t> ids_;
  std::size_t total_ = 0;
};

void check_limit(std::size_t value, std::size_t limit, const char* field) {
  if (value <= limit) return;
  throw Error(ErrorCode::kMeshTooLarge,
              std::string(field) + ": " + std::to_string(value) + " is more than the limit of " +
                  std::to_string(limit) + "; split the part or use a coarser control mesh",
              field);
}

void check_sizes(const ControlMesh& mesh, const MeshLimits& limits) {
  if (mesh.cell_count() == 0) {
    throw Error(ErrorCode::kMeshEmpty, "the mesh has no cells: a solid needs at least one", "cells");
  }
  if (mesh.vertex_count() == 0) throw Error(ErrorCode::kMeshEmpty, "the mesh has no vertices", "positions");
  check_limit(mesh.vertex_count(), limits.max_vertices, "positions");
  check_limit(mesh.cell_count(), limits.max_cells, "cells");
  check_limit(mesh.channel_count(), limits.max_channels, "channels");
  std::size_t corners = 0;
  for (const CellKind kind : mesh.cell_kinds) corners += static_cast<std::size_t>(corner_count(kind));
  if (corners != mesh.cell_vertices.size()) {
    throw Error(ErrorCode::kMeshMalformed,
                "cell_vertices holds " + std::to_string(mesh.cell_vertices.size()) + " corners, but the " +
                    std::to_string(mesh.cell_count()) + " cells need " + std::to_string(corners),
                "cell_vertices");
  }
  if (mesh.channel_values.size() != mesh.vertex_count() * mesh.channel_count()) {
    throw Error(ErrorCode::kMeshBadChannel,
                "channel_values holds " + std::to_string(mesh.channel_values.size()) + " values, but " +
                    std::to_string(mesh.vertex_count()) + " vertices with " + std::to_string(mesh.channel_count()) +
                    " channels need " + std::to_string(mesh.vertex_count() * mesh.channel_count()),
                "channel_values");
  }
}

void check_channels(const ControlMesh& mesh, const MeshLimits& limits) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < mesh.channel_count(); ++i) {
    const std::string& name = mesh.channel_names[i];
    const std::string which = "channel " + std::to_string(i);
    if (name.empty()) throw Error(ErrorCode::kMeshBadChannel, which + " has no name: give each one", "channels");
    if (name.size() > limits.max_channel_name_bytes) {
      throw Error(
          ErrorCode::kMeshBadChannel,
          which + "'s name is longer than " + std::to_string(limits.max_channel_name_bytes) + " bytes: shorten it",
          "channels");
    }
    if (!seen.insert(name).second) {
      throw Error(ErrorCode::kMeshBadChannel, which + " repeats the name '" + name + "': rename one", "channels");
    }
  }
}

void check_numbers(const ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders positions, far, values;
  const std::size_t channels = mesh.channel_count();
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    poll();
    const Vec3& p = mesh.positions[v];
    if (!p.allFinite()) {
      positions.add(static_cast<std::int64_t>(v));
    } else if (p.cwiseAbs().maxCoeff() > limits.max_abs_coordinate_mm) {
      far.add(static_cast<std::int64_t>(v));
    }
    const auto first = mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(v * channels);
    if (!std::all_of(first, first + static_cast<std::ptrdiff_t>(channels), [](float x) { return std::isfinite(x); })) {
      values.add(static_cast<std::int64_t>(v));
    }
  }
  positions.throw_if_any(ErrorCode::kMeshNonFinite, "NaN or infinite position at vertices", "give finite millimetres",
                         "positions");
  far.throw_if_any(ErrorCode::kMeshTooLarge, "coordinates beyond the limit at vertices",
                   "positions are in mm, at most " + std::to_string(limits.max_abs_coordinate_mm) + " from the origin",
                   "positions");
  values.throw_if_any(ErrorCode::kMeshNonFinite, "NaN or infinite channel value at vertices", "give finite values",
                      "channel_values");
}

void check_indices(const ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders range, repeated, isolated, valence, edges, vertices;
  const auto n = static_cast<std::uint32_t>(mesh.vertex_count());
  std::vector<std::uint32_t> used(n, 0);  // By how many cells.
  std::size_t begin = 0;
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    poll();
    const auto count = static_cast<std::size_t>(corner_count(mesh.cell_kinds[c]));
    const std::span corners(&mesh.cell_vertices[begin], count);
    begin += count;
    if (std::any_of(corners.begin(), corners.end(), [n](std::uint32_t v) { return v >= n; })) {
      range.add(static_cast<std::int64_t>(c));
      continue;
    }
    std::vector<std::uint32_t> sorted(corners.begin(), corners.end());
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) repeated.add(static_cast<std::int64_t>(c));
    for (const std::uint32_t v : corners) ++used[v];
  }
  const std::string bound = "vertex ids run from 0 to " + std::to_string(n - 1);
  range.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "vertex id out of range in cells", bound, "cell_vertices");
  repeated.throw_if_any(ErrorCode::kMeshRepeatedVertex, "a vertex is repeated in cells",
                        "collapsed cells never refine to hexahedra: remove or remesh them", "cell_vertices");
  for (std::uint32_t v = 0; v < n; ++v) {
    if (used[v] == 0) isolated.add(v);
    if (used[v] > limits.max_vertex_valence) valence.add(v);
  }
  isolated.throw_if_any(ErrorCode::kMeshIsolatedVertex, "no cell uses vertices", "remove them", "positions");
  // Before anything is built whose cost grows with the square of a valence.
  valence.throw_if_any(ErrorCode::kMeshValenceTooHigh, "too many cells round vertices",
                       "the limit is " + std::to_string(limits.max_vertex_valence), "cells");
  for (std::size_t i = 0; i < mesh.sharp_edges.size(); ++i) {
    if (std::max(mesh.sharp_edges[i][0], mesh.sharp_edges[i][1]) >= n) edges.add(static_cast<std::int64_t>(i));
  }
  edges.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "vertex id out of range in sharp edges", bound, "sharp_edges");
  for (const std::uint32_t v : mesh.sharp_vertices) {
    if (v >= n) vertices.add(v);
  }
  vertices.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "sharp vertices out of range:", bound, "sharp_vertices");
}

/// The neighbours of an item in a small graph; counts what a walk from the first item reaches.
template <typename Neighbours>
std::size_t reachable(std::span<const std::uint32_t> items, Neighbours neighbours) {
  std::vector<std::uint32_t> stack{items.front()}, seen{items.front()};
  while (!stack.empty()) {
    const std::uint32_t item = stack.back();
    stack.pop_back();
    neighbours(item, [&](std::uint32_t next) {
      if (std::find(seen.begin(), seen.end(), next) != seen.end()) return;
      seen.push_back(next);
      stack.push_back(next);
    });
  }
  return seen.size();
}

/// Visits the cells across those of a cell's faces that pass `through`.
template <typename Through, typename Visit>
void cells_across(const CellComplex& complex, std::uint32_t cell, Through through, Visit visit) {
  for (const std::uint32_t h : complex.cell_half_faces(cell)) {
    const std::uint32_t other = complex.half_face_cell(h ^ 1);
    if (other != kNone && through(h / 2)) visit(other);
  }
}

bool contains(std::span<const std::uint32_t> items, std::uint32_t item) {
  return std::find(items.begin(), items.end(), item) != items.end();
}

void check_shared_faces(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  for (std::uint32_t c = 0; c < complex.cell_count(); ++c) {
    poll();
    std::vector<std::uint32_t> others;
    cells_across(
        complex, c, [](std::uint32_t) { return true; }, [&](std::uint32_t o) { others.push_back(o); });
    std::sort(others.begin(), others.end());
    const auto twice = std::adjacent_find(others.begin(), others.end());
    if (twice == others.end()) continue;
    throw Error(ErrorCode::kMeshSharedFaces,
                "cells " + std::to_string(c) + " and " + std::to_string(*twice) +
                    " share more than one face: the edge between those faces has valence 2; merge the cells or remesh",
                "cells", {c, *twice});
  }
}

bool edge_is_manifold(const CellComplex& complex, std::uint32_t edge) {
  const auto faces = complex.edge_faces(edge);
  const auto boundary =
      std::count_if(faces.begin(), faces.end(), [&](std::uint32_t f) { return complex.face_on_boundary(f); });
  if (boundary != 0 && boundary != 2) return false;
  const auto through = [&](std::uint32_t f) { return contains(faces, f); };
  return reachable(complex.edge_cells(edge), [&](std::uint32_t c, auto visit) {
           cells_across(complex, c, through, visit);
         }) == complex.edge_cells(edge).size();
}

void check_edges(const CellComplex& complex, const MeshLimits& limits, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  for (std::uint32_t e = 0; e < complex.edge_count(); ++e) {
    poll();
    const auto [a, b] = complex.edge_vertices(e);
    const std::string which = "edge " + std::to_string(a) + "-" + std::to_string(b);
    if (!edge_is_manifold(complex, e)) {
      throw Error(ErrorCode::kMeshNonManifoldEdge,
                  which +
                      " isn't manifold: its cells must form one ring, or one fan between two boundary faces; "
                      "separate the parts or fill the gap",
                  "cells", {a, b});
    }
    const std::size_t valence = complex.edge_cells(e).size();
    if (!complex.edge_on_boundary(e) && valence < 3) {
      throw Error(ErrorCode::kMeshSharedFaces,
                  which + " lies inside with only " + std::to_string(valence) + " cells round it; merge them or remesh",
                  "cells", {a, b});
    }
    if (valence > limits.max_edge_valence) {
      throw Error(ErrorCode::kMeshValenceTooHigh,
                  which + " has " + std::to_string(valence) + " cells round it; the limit is " +
                      std::to_string(limits.max_edge_valence),
                  "cells", {a, b});
    }
  }
}

/// One ball or one half-ball: the link is connected and its Euler characteristic that of a sphere or a disc.
bool vertex_is_manifold(const CellComplex& complex, std::uint32_t vertex) {
  const auto cells = complex.vertex_cells(vertex);
  const auto faces = complex.vertex_faces(vertex);
  const auto through = [&](std::uint32_t f) { return contains(faces, f); };
  if (reachable(cells, [&](std::uint32_t c, auto visit) { cells_across(complex, c, through, visit); }) !=
      cells.size()) {
    return false;
  }
  const auto euler = static_cast<std::ptrdiff_t>(complex.vertex_edges(vertex).size()) -
                     static_cast<std::ptrdiff_t>(faces.size()) + static_cast<std::ptrdiff_t>(cells.size());
  return euler == (complex.vertex_on_boundary(vertex) ? 1 : 2);
}

void check_vertices(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders pinched;
  for (std::uint32_t v = 0; v < complex.vertex_count(); ++v) {
    poll();
    if (!vertex_is_manifold(complex, v)) pinched.add(v);
  }
  pinched.throw_if_any(ErrorCode::kMeshNonManifoldVertex,
                       "the cells form neither one ball nor one half-ball at vertices",
                       "parts that touch in a point or along an edge must be separated or joined by faces", "cells");
}

/// Det of the three edge vectors at a corner; hexahedra's corners are bits, where odd corners mirror.
double corner_determinant(const ControlMesh& mesh, const CellComplex& complex, std::uint32_t cell, std::size_t corner) {
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
bool sides_oppose(const CellComplex& complex, std::uint32_t face) {
  const auto ring = complex.face_vertices(face);
  const std::uint32_t cell = complex.half_face_cell(2 * face + 1);
  const LocalFace& shape = cell_topology(complex.kind(cell)).faces[complex.half_face_local(2 * face + 1)];
  std::size_t first = 0;
  while (complex.cell_vertices(cell)[shape.corners[first]] != ring[0]) ++first;
  return complex.cell_vertices(cell)[shape.corners[(first + 1) % shape.size]] == ring[ring.size() - 1];
}

/// Adds the cells on both sides of faces that, once `mirrored` is applied, have both cells on the same side.
void find_overlapping_neighbours(const CellComplex& complex, const std::vector<std::uint8_t>& mirrored,
                                 std::vector<std::uint32_t>& inverted) {
  for (std::uint32_t f = 0; f < complex.face_count(); ++f) {
    if (complex.face_on_boundary(f)) continue;
    const std::uint32_t a = complex.half_face_cell(2 * f), b = complex.half_face_cell(2 * f + 1);
    if (sides_oppose(complex, f) == (mirrored[a] == mirrored[b])) continue;
    inverted.insert(inverted.end(), {a, b});
  }
  std::sort(inverted.begin(), inverted.end());
  inverted.erase(std::unique(inverted.begin(), inverted.end()), inverted.end());
}

/// Corrects cells whose corners are all negative, and returns the cells that are partly so, and neighbours that lie on
/// the same side of their common face.
std::vector<std::uint32_t> orient(ControlMesh& mesh, const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  std::vector<std::uint32_t> inverted;
  std::vector<std::uint8_t> mirrored(complex.cell_count(), 0);
  std::vector<std::uint32_t> corners = mesh.cell_vertices;
  std::size_t begin = 0;
  for (std::uint32_t c = 0; c < complex.cell_count(); ++c) {
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
    } else if (positive != n) {
      inverted.push_back(c);
    }
    begin += n;
  }
  find_overlapping_neighbours(complex, mirrored, inverted);
  if (inverted.empty() || mesh.allow_folds) mesh.cell_vertices = std::move(corners);
  return inverted;
}

void check_sharp_features(const ControlMesh& mesh, const CellComplex& complex) {
  std::set<std::uint32_t> edges, vertices;
  for (const auto& [a, b] : mesh.sharp_edges) {
    const std::uint32_t e = complex.find_edge(a, b);
    const std::string which = "sharp edge " + std::to_string(a) + "-" + std::to_string(b);
    if (e == kNone || !complex.edge_on_boundary(e)) {
      throw Error(ErrorCode::kMeshBadSharpFeature,
                  which + (e == kNone ? " is no edge of any cell" : " lies inside the solid") +
                      ": only edges on the boundary can be sharp",
                  "sharp_edges", {std::min(a, b), std::max(a, b)});
    }
    if (!edges.insert(e).second) {
      throw Error(ErrorCode::kMeshBadSharpFeature, which + " is given twice: name each once", "sharp_edges",
                  {std::min(a, b), std::max(a, b)});
    }
  }
  for (const std::uint32_t v : mesh.sharp_vertices) {
    const std::string which = "sharp vertex " + std::to_string(v);
    if (!complex.vertex_on_boundary(v)) {
      throw Error(ErrorCode::kMeshBadSharpFeature,
                  which + " lies inside the solid: only vertices on the boundary can be sharp", "sharp_vertices", {v});
    }
    if (!vertices.insert(v).second) {
      throw Error(ErrorCode::kMeshBadSharpFeature, which + " is given twice: name each once", "sharp_vertices", {v});
    }
  }
}

}  // namespace

MeshReport validate(ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  check_sizes(mesh, limits);
  check_channels(mesh, limits);
  check_numbers(mesh, limits, cancel);
  check_indices(mesh, limits, cancel);
  const CellComplex complex = make_cell_complex(mesh, cancel);
  check_shared_faces(complex, cancel);
  check_edges(complex, limits, cancel);
  check_vertices(complex, cancel);
  check_sharp_features(mesh, complex);
  MeshReport report;
  report.inverted_cells = orient(mesh, complex, cancel);
  if (!mesh.allow_folds) {
    Offenders inverted;
    for (const std::uint32_t c : report.inverted_cells) inverted.add(c);
    inverted.throw_if_any(ErrorCode::kMeshInvertedCell,
                          "a corner of non-positive Jacobian, or a neighbour on the same side of a face, in cells",
                          "untangle them, or set allow_folds to slice the solid as it is", "cells");
  }
  return report;
}

}  // namespace ccslice
