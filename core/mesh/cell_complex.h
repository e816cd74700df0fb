// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cell complex: cells, faces, edges and vertices of a control mesh or of a refined part of one, with their
// incidences, as in OpenVolumeMesh [Luu19, 4]. A face has two half-faces (half-face = 2 * face + side); the opposite is
// `^ 1`, and a half-face without a cell lies on the boundary.
//
// A complex may be AS MESHED: then nothing in it is smoothed, each of its hexahedra is a patch of its own, and refining
// only parts cells (ControlMesh::as_meshed).
//
// A complex may be a CUT-OUT: then only some vertices are COMPLETE, i.e. all their cells are present. Everything
// about edges, faces and the boundary is true at complete vertices and meaningless elsewhere.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

inline constexpr std::uint32_t kNone = 0xffffffffu;

inline FaceId face_of(HalfFaceId half_face) { return FaceId{half_face / 2}; }
inline HalfFaceId opposite(HalfFaceId half_face) { return HalfFaceId{half_face ^ 1}; }
/// Its side 0, which always has a cell, and its side 1.
inline std::array<HalfFaceId, 2> half_faces_of(FaceId face) { return {HalfFaceId{2 * face}, HalfFaceId{2 * face + 1}}; }

/// Compressed rows: the items of row r are items[offsets[r] .. offsets[r+1]).
template <typename Row, typename Item>
struct Incidence {
  std::vector<std::uint32_t> offsets;
  std::vector<Item> items;

  std::span<const Item> operator[](Row row) const {
    return std::span(items).subspan(offsets[row], offsets[row + 1] - offsets[row]);
  }
};

class CellComplex {
 public:
  /// Cells by kinds and concatenated corners (hexahedra: bits order, see cell_kind.h). Sharp edges are vertex pairs.
  /// Makes no check but this one: throws Error{kMeshNonManifoldFace} if a face has more than two cells, and
  /// Error{kCancelled}. Takes time in proportion to the cells times their number round a vertex.
  CellComplex(std::uint32_t vertex_count, std::vector<CellKind> kinds, std::vector<VertexId> corners,
              std::span<const std::array<std::uint32_t, 2>> sharp_edges, std::span<const std::uint32_t> sharp_vertices,
              const CancellationToken& cancel = {});

  /// Its cells are taken as meshed. DEFAULT: false.
  bool as_meshed() const { return as_meshed_; }
  void take_as_meshed(bool as_meshed) { as_meshed_ = as_meshed; }

  std::uint32_t vertex_count() const { return vertex_count_; }
  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(kinds_.size()); }
  std::uint32_t face_count() const { return static_cast<std::uint32_t>(half_face_cell_.size() / 2); }
  std::uint32_t edge_count() const { return static_cast<std::uint32_t>(edge_vertices_.size()); }

  IdRange<VertexId> vertices() const { return IdRange<VertexId>{vertex_count()}; }
  IdRange<CellId> cells() const { return IdRange<CellId>{cell_count()}; }
  IdRange<FaceId> faces() const { return IdRange<FaceId>{face_count()}; }
  IdRange<EdgeId> edges() const { return IdRange<EdgeId>{edge_count()}; }

  CellKind kind(CellId cell) const { return kinds_[cell]; }
  std::span<const VertexId> cell_vertices(CellId cell) const {
    return std::span(corners_).subspan(corner_begin_[cell], static_cast<std::size_t>(corner_count(kinds_[cell])));
  }
  /// Half-faces of a cell in the order of its local faces; edges in the order of its local edges.
  std::span<const HalfFaceId> cell_half_faces(CellId cell) const {
    return std::span(cell_half_faces_).subspan(face_begin_[cell], cell_topology(kinds_[cell]).faces.size());
  }
  std::span<const EdgeId> cell_edges(CellId cell) const {
    return std::span(cell_edges_).subspan(edge_begin_[cell], cell_topology(kinds_[cell]).edges.size());
  }

  /// Cell of a half-face, or kNone on the boundary; and the face's number within that cell.
  CellId half_face_cell(HalfFaceId half_face) const { return half_face_cell_[half_face]; }
  std::uint8_t half_face_local(HalfFaceId half_face) const { return half_face_local_[half_face]; }
  bool face_on_boundary(FaceId face) const { return half_face_cell_[half_faces_of(face)[1]] == kNone; }
  /// Vertices of a face, counter-clockwise seen from outside its first cell.
  std::span<const VertexId> face_vertices(FaceId face) const {
    return std::span(face_vertices_[face]).first(face_size_[face]);
  }

  std::array<VertexId, 2> edge_vertices(EdgeId edge) const { return edge_vertices_[edge]; }
  VertexId edge_other(EdgeId edge, VertexId vertex) const {
    return edge_vertices_[edge][edge_vertices_[edge][0] == vertex];
  }
  std::span<const CellId> edge_cells(EdgeId edge) const { return edge_cells_[edge]; }
  std::span<const FaceId> edge_faces(EdgeId edge) const { return edge_faces_[edge]; }
  bool edge_on_boundary(EdgeId edge) const { return edge_boundary_[edge] != 0; }
  bool edge_sharp(EdgeId edge) const { return edge_sharp_[edge] != 0; }

  std::span<const CellId> vertex_cells(VertexId vertex) const { return vertex_cells_[vertex]; }
  std::span<const FaceId> vertex_faces(VertexId vertex) const { return vertex_faces_[vertex]; }
  std::span<const EdgeId> vertex_edges(VertexId vertex) const { return vertex_edges_[vertex]; }
  bool vertex_on_boundary(VertexId vertex) const { return vertex_boundary_[vertex] != 0; }
  bool vertex_sharp(VertexId vertex) const { return vertex_sharp_[vertex] != 0; }

  /// The edge between two vertices, or kNone.
  EdgeId find_edge(VertexId a, VertexId b) const;

 private:
  void number_cells();
  HalfFaceId add_face(CellId cell, std::uint8_t local);
  void build_faces(const CancellationToken& cancel);
  void build_edges(const CancellationToken& cancel);
  void build_incidences(const CancellationToken& cancel);
  void mark_boundary();

  std::uint32_t vertex_count_;
  bool as_meshed_ = false;
  std::vector<CellKind> kinds_;
  std::vector<VertexId> corners_;
  std::vector<std::uint32_t> corner_begin_, face_begin_, edge_begin_;
  std::vector<HalfFaceId> cell_half_faces_;
  std::vector<EdgeId> cell_edges_;
  std::vector<CellId> half_face_cell_;
  std::vector<std::uint8_t> half_face_local_;
  std::vector<std::array<VertexId, 4>> face_vertices_;
  std::vector<std::uint8_t> face_size_;
  std::vector<std::array<VertexId, 2>> edge_vertices_;
  Incidence<EdgeId, CellId> edge_cells_;
  Incidence<EdgeId, FaceId> edge_faces_;
  Incidence<VertexId, CellId> vertex_cells_;
  Incidence<VertexId, FaceId> vertex_faces_;
  Incidence<VertexId, EdgeId> vertex_edges_;
  std::vector<std::uint8_t> edge_boundary_, edge_sharp_, vertex_boundary_, vertex_sharp_;
};

/// The complex of a control mesh: hexahedra's corners turned from VTK order into bits. REQUIRES: indices in range.
CellComplex make_cell_complex(const ControlMesh& mesh, const CancellationToken& cancel = {});

}  // namespace ccslice
