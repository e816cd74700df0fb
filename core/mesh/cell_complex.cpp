// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_complex.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace ccslice {

namespace {

/// Turns (row, item) pairs, given by two passes of `visit(emit)`, into compressed rows; items keep their order.
template <typename Row, typename Item, typename Visit>
Incidence<Row, Item> make_incidence(std::uint32_t rows, Visit visit) {
  Incidence<Row, Item> result;
  result.offsets.assign(rows + 1, 0);
  visit([&](Row row, Item) { ++result.offsets[row + 1]; });
  for (std::uint32_t r = 0; r < rows; ++r) result.offsets[r + 1] += result.offsets[r];
  result.items.resize(result.offsets[rows]);
  std::vector<std::uint32_t> next(result.offsets.begin(), result.offsets.end() - 1);
  visit([&](Row row, Item item) { result.items[next[row]++] = item; });
  return result;
}

/// The vertices of a half-face in ascending order; triangles end with kNone. They number their slots in
/// cell_half_faces_.
using SortedFace = std::array<VertexId, 4>;
constexpr SortedFace kNoVertices = {VertexId{kNone}, VertexId{kNone}, VertexId{kNone}, VertexId{kNone}};

/// A cell's own face.
struct FaceOfCell {
  CellId cell;
  std::uint8_t local;
};

/// Five compare-exchanges.
void sort(SortedFace& face) {
  const auto order = [&](std::size_t i, std::size_t j) {
    const VertexId low = std::min(face[i], face[j]), high = std::max(face[i], face[j]);
    face[i] = low, face[j] = high;
  };
  order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
}

bool same(const SortedFace& a, const SortedFace& b) {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2]) | (a[3] ^ b[3])) == 0;
}

/// `faces`: how many there are.
Error face_of_three(const std::vector<std::int64_t>& cells, std::size_t faces) {
  const std::string others =
      faces == 1 ? ""
                 : ", and there " +
                       (faces == 2 ? "is one more such face" : "are " + std::to_string(faces - 1) + " more such faces");
  return Error(ErrorCode::kMeshNonManifoldFace,
               "cells " + std::to_string(cells[0]) + ", " + std::to_string(cells[1]) + " and " +
                   std::to_string(cells[2]) + " share one face" + others +
                   "; a face belongs to at most two cells: remove the surplus cells",
               "cell_vertices", cells);
}

}  // namespace

CellComplex::CellComplex(std::uint32_t vertex_count, std::vector<CellKind> kinds, std::vector<VertexId> corners,
                         std::span<const std::array<std::uint32_t, 2>> sharp_edges,
                         std::span<const std::uint32_t> sharp_vertices, const CancellationToken& cancel)
    : vertex_count_(vertex_count), kinds_(std::move(kinds)), corners_(std::move(corners)) {
  number_cells();
  build_faces(cancel);
  build_edges(cancel);
  build_incidences(cancel);
  mark_boundary();
  vertex_sharp_.assign(vertex_count_, 0);
  for (const std::uint32_t v : sharp_vertices) vertex_sharp_[v] = 1;
  edge_sharp_.assign(edge_vertices_.size(), 0);
  for (const auto& [a, b] : sharp_edges) {
    if (const EdgeId e = find_edge(VertexId{a}, VertexId{b}); e != kNone) edge_sharp_[e] = 1;
  }
}

void CellComplex::number_cells() {
  std::uint32_t corner = 0, face = 0, edge = 0;
  for (auto* begins : {&corner_begin_, &face_begin_, &edge_begin_}) begins->reserve(kinds_.size());
  for (const CellKind kind : kinds_) {
    corner_begin_.push_back(corner);
    face_begin_.push_back(face);
    edge_begin_.push_back(edge);
    corner += static_cast<std::uint32_t>(corner_count(kind));
    face += static_cast<std::uint32_t>(cell_topology(kind).faces.size());
    edge += static_cast<std::uint32_t>(cell_topology(kind).edges.size());
  }
  cell_half_faces_.assign(face, HalfFaceId{kNone});
  cell_edges_.assign(edge, EdgeId{kNone});
}

HalfFaceId CellComplex::add_face(CellId cell, std::uint8_t local) {
  const HalfFaceId added = half_faces_of(FaceId{face_count()})[0];
  half_face_cell_.insert(half_face_cell_.end(), {cell, CellId{kNone}});
  half_face_local_.insert(half_face_local_.end(), {local, 0});
  const LocalFace& shape = cell_topology(kinds_[cell]).faces[local];
  std::array<VertexId, 4> ring = kNoVertices;
  for (int k = 0; k < shape.size; ++k) ring[k] = cell_vertices(cell)[shape.corners[k]];
  face_vertices_.push_back(ring);
  face_size_.push_back(shape.size);
  return added;
}

void CellComplex::build_faces(const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  // Half-faces are bucketed by their smallest vertex and matched within a bucket; faces are numbered by first cell.
  std::vector<SortedFace> refs;
  std::vector<FaceOfCell> owner;  // By slot.
  refs.reserve(cell_half_faces_.size());
  owner.reserve(cell_half_faces_.size());
  for (const CellId c : cells()) {
    poll();
    const auto vertices = cell_vertices(c);
    const auto local_faces = cell_topology(kinds_[c]).faces;
    for (std::uint8_t f = 0; f < local_faces.size(); ++f) {
      SortedFace ref = kNoVertices;
      for (int i = 0; i < local_faces[f].size; ++i) ref[i] = vertices[local_faces[f].corners[i]];
      sort(ref);
      refs.push_back(ref);
      owner.push_back({c, f});
    }
  }
  const auto buckets = make_incidence<VertexId, std::uint32_t>(vertex_count_, [&](auto emit) {
    for (std::uint32_t i = 0; i < refs.size(); ++i) emit(refs[i][0], i);
  });
  // At least half of the half-faces have faces of their own, some more on the boundary.
  const std::size_t faces_expected = refs.size() / 2 + refs.size() / 8;
  half_face_cell_.reserve(2 * faces_expected);
  half_face_local_.reserve(2 * faces_expected);
  face_vertices_.reserve(faces_expected);
  face_size_.reserve(faces_expected);
  std::vector<std::int64_t> crowd;  // Three cells of the first face that has more than two.
  std::size_t crowded = 0;          // Such faces.
  for (std::uint32_t i = 0; i < refs.size(); ++i) {
    poll();
    const auto [cell, local] = owner[i];
    if (cell_half_faces_[i] == kNone) cell_half_faces_[i] = add_face(cell, local);
    if (cell_half_faces_[i] & 1) continue;
    const HalfFaceId across = opposite(cell_half_faces_[i]);
    bool is_crowded = false;
    for (const std::uint32_t j : buckets[refs[i][0]]) {
      if (j <= i || !same(refs[j], refs[i])) continue;
      if (half_face_cell_[across] != kNone) {
        if (crowd.empty()) crowd = {cell, half_face_cell_[across], owner[j].cell};
        is_crowded = true;
        cell_half_faces_[j] = across;  // No face of its own.
        continue;
      }
      cell_half_faces_[j] = across;
      half_face_cell_[across] = owner[j].cell;
      half_face_local_[across] = owner[j].local;
    }
    crowded += is_crowded;
  }
  if (crowded > 0) throw face_of_three(crowd, crowded);
  half_face_cell_.shrink_to_fit();
  half_face_local_.shrink_to_fit();
  face_vertices_.shrink_to_fit();
  face_size_.shrink_to_fit();
}

void CellComplex::build_edges(const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  // An edge is found in the bucket of its smaller vertex; edges are numbered by first cell.
  std::vector<std::array<VertexId, 2>> ends;
  ends.reserve(cell_edges_.size());
  for (const CellId c : cells()) {
    poll();
    const auto vertices = cell_vertices(c);
    for (const auto& [i, j] : cell_topology(kinds_[c]).edges) {
      ends.push_back({std::min(vertices[i], vertices[j]), std::max(vertices[i], vertices[j])});
    }
  }
  const auto buckets = make_incidence<VertexId, std::uint32_t>(vertex_count_, [&](auto emit) {
    for (std::uint32_t i = 0; i < ends.size(); ++i) emit(ends[i][0], i);
  });
  edge_vertices_.reserve(ends.size() / 3);  // Large meshes have about a quarter as many edges, small ones more.
  for (std::uint32_t i = 0; i < ends.size(); ++i) {
    poll();
    if (cell_edges_[i] != kNone) continue;
    const EdgeId edge{edge_count()};
    edge_vertices_.push_back(ends[i]);
    for (const std::uint32_t j : buckets[ends[i][0]]) {
      if (ends[j][1] == ends[i][1]) cell_edges_[j] = edge;
    }
  }
  edge_vertices_.shrink_to_fit();
}

void CellComplex::build_incidences(const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  cancel.throw_if_cancelled();
  edge_cells_ = make_incidence<EdgeId, CellId>(edge_count(), [&](auto emit) {
    for (const CellId c : cells()) {
      for (const EdgeId e : cell_edges(c)) emit(e, c);
    }
  });
  cancel.throw_if_cancelled();
  vertex_cells_ = make_incidence<VertexId, CellId>(vertex_count_, [&](auto emit) {
    for (const CellId c : cells()) {
      for (const VertexId v : cell_vertices(c)) emit(v, c);
    }
  });
  cancel.throw_if_cancelled();
  vertex_edges_ = make_incidence<VertexId, EdgeId>(vertex_count_, [&](auto emit) {
    for (const EdgeId e : edges()) {
      for (const VertexId v : edge_vertices_[e]) emit(v, e);
    }
  });
  cancel.throw_if_cancelled();
  vertex_faces_ = make_incidence<VertexId, FaceId>(vertex_count_, [&](auto emit) {
    for (const FaceId f : faces()) {
      for (const VertexId v : face_vertices(f)) emit(v, f);
    }
  });
  std::vector<EdgeId> sides;  // Edges of the faces' sides, one face after the other.
  sides.reserve(cell_half_faces_.size() / 2 * 5);
  for (const FaceId f : faces()) {
    poll();
    const auto ring = face_vertices(f);
    for (std::size_t i = 0; i < ring.size(); ++i) sides.push_back(find_edge(ring[i], ring[(i + 1) % ring.size()]));
  }
  edge_faces_ = make_incidence<EdgeId, FaceId>(edge_count(), [&](auto emit) {
    auto side = sides.begin();
    for (const FaceId f : faces()) {
      for (std::size_t i = 0; i < face_size_[f]; ++i) emit(*side++, f);
    }
  });
}

void CellComplex::mark_boundary() {
  edge_boundary_.assign(edge_count(), 0);
  vertex_boundary_.assign(vertex_count_, 0);
  for (const EdgeId e : edges()) {
    for (const FaceId f : edge_faces_[e]) edge_boundary_[e] |= face_on_boundary(f);
    if (!edge_boundary_[e]) continue;
    for (const VertexId v : edge_vertices_[e]) vertex_boundary_[v] = 1;
  }
}

EdgeId CellComplex::find_edge(VertexId a, VertexId b) const {
  for (const EdgeId e : vertex_edges_[a]) {
    if (edge_other(e, a) == b) return e;
  }
  return EdgeId{kNone};
}

CellComplex make_cell_complex(const ControlMesh& mesh, const CancellationToken& cancel) {
  std::vector<VertexId> corners;
  corners.reserve(mesh.cell_vertices.size());
  std::size_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    const int n = corner_count(kind);
    for (int i = 0; i < n; ++i) {
      corners.emplace_back(mesh.cell_vertices[begin + vtk_corner(kind, static_cast<std::uint8_t>(i))]);
    }
    begin += static_cast<std::size_t>(n);
  }
  CellComplex complex(static_cast<std::uint32_t>(mesh.vertex_count()), mesh.cell_kinds, std::move(corners),
                      mesh.sharp_edges, mesh.sharp_vertices, cancel);
  complex.take_as_meshed(mesh.as_meshed);
  return complex;
}

}  // namespace ccslice
