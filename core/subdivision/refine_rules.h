// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The rules of Catmull-Clark refinement of solids (Joy and MacCracken 1999), made separable along extraordinary edges.
//
// C: mean of a cell's vertices, A: mean of a face's, M: edge midpoint, P: the old vertex; a bar is the plain mean over
// all incident items of the OLD complex; n: cells round an edge.
//
//   cell point                   C
//   interior face point          (C0 + 2 A + C1) / 4
//   interior edge point          (Cbar + 2 Abar + (n-3) M) / n
//   interior vertex              (Cbar + 3 Abar + 3 Mbar + P) / 8
//   ... on a straight EE         [Cbar + Ah + 2 Av + 2 Mh + (n-3) Mv + (n-3) P] / (2n)
//                                Av / Ah: mean centroid of the faces that do / do not contain one of the two EEs,
//                                Mv / Mh: mean midpoint of the two EEs / of the other edges
//   boundary face                A
//   boundary edge                (v0 + v1 + A0 + A1) / 4; sharp: M
//   boundary vertex              (Q + 2R + (k-3) P) / k; exactly two sharp edges to a and b: (a + 6P + b) / 8;
//                                three or more, or tagged: P
//
// In a complex that is as meshed cells are parted and nothing moves: C, A, M and P, inside and on the boundary.
//
// An interior edge with n != 4 is EXTRAORDINARY (EE). An interior vertex is on a STRAIGHT EE if it has exactly two EEs,
// both of valence n, 2n cells and n + 2 edges. The rule there is ours: Joy and MacCracken's isn't separable, data
// constant along the EE wouldn't stay so, and the constant-time evaluation of [Luu19, 3] would not exist. With it a
// cell at an EE is exactly (Catmull-Clark surface of valence n) x (cubic B-spline). On regular complexes all this is
// the tricubic B-spline.

#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/stencils.h"

namespace ccslice {

/// True if the vertex lies on a straight EE (see above). REQUIRES: complete.
bool on_straight_extraordinary_edge(const CellComplex& complex, VertexId vertex);

/// The edge is interior, with other than four cells. REQUIRES: one of its vertices is complete.
bool is_extraordinary(const CellComplex& complex, EdgeId edge);

/// A weighted sum of child vertices, as one row over the parent's vertices. REQUIRES: what the items touch is complete.
class RuleRow {
 public:
  explicit RuleRow(const CellComplex& parent) : parent_(parent), weight_(parent.vertex_count(), 0.0) {}

  void add_vertex_point(VertexId vertex, double weight = 1);
  void add_edge_point(EdgeId edge, double weight = 1);
  void add_face_point(FaceId face, double weight = 1);
  void add_cell_point(CellId cell, double weight = 1);
  /// A vertex of the parent.
  void add_vertex(VertexId vertex, double weight);

  /// Appends the row, indices ascending, and starts the next one.
  void flush(Stencils& stencils);

 private:
  void add_mean(std::span<const VertexId> vertices, double weight);
  void add_cell(CellId cell, double weight) { add_mean(parent_.cell_vertices(cell), weight); }
  void add_face(FaceId face, double weight) { add_mean(parent_.face_vertices(face), weight); }
  void add_edge(EdgeId edge, double weight) { add_mean(parent_.edge_vertices(edge), weight); }
  void add_cells(std::span<const CellId> cells, double weight);
  void add_faces(std::span<const FaceId> faces, double weight);
  void add_edges(std::span<const EdgeId> edges, double weight);
  void add_boundary_vertex_point(VertexId vertex, double weight);
  void add_straight_vertex_point(VertexId vertex, double weight);

  const CellComplex& parent_;
  std::vector<double> weight_;
  std::vector<VertexId> touched_;
  std::vector<std::pair<std::uint32_t, double>> entries_;
};

}  // namespace ccslice
