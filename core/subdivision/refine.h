// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One step of Catmull-Clark refinement of solids (Joy and MacCracken 1999), made separable along extraordinary edges.
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
// An interior edge with n != 4 is EXTRAORDINARY (EE). An interior vertex is on a STRAIGHT EE if it has exactly two EEs,
// both of valence n, 2n cells and n + 2 edges. The rule there is ours: Joy and MacCracken's isn't separable, data
// constant along the EE wouldn't stay so, and the constant-time evaluation of [Luu19, 3] would not exist. With it a
// cell at an EE is exactly (Catmull-Clark surface of valence n) x (cubic B-spline). On regular complexes all this is
// the tricubic B-spline.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/stencils.h"

namespace ccslice {

/// The children of some cells of a complex, and the children next to them, as a cut-out complex of hexahedra.
struct Refinement {
  CellComplex complex;
  Stencils stencils;                    // Row r: child vertex r from the parent's vertices.
  std::vector<CellId> first_child;      // By refined cell: its children follow in the order of its corners.
  std::uint32_t edge_points_begin = 0;  // Child vertices: vertex, edge, face, then cell points.
  std::uint32_t face_points_begin = 0;
  std::uint32_t cell_points_begin = 0;
  std::vector<std::uint32_t> origin;  // The parent's vertex, edge, face or cell of each child vertex.
};

/// Refines `cells` (ascending): the result holds, for each vertex v of these cells, every child at v. So the vertices
/// of their children are complete. A child at corner i of a hexahedron keeps the parent's axes and is its i-th in
/// corner bits; at corner i of a tet or wedge its origin is the corner and its axes run along corner_neighbours[i].
/// REQUIRES: the vertices of `cells` are complete. Throws Error{kCancelled} only.
Refinement refine(const CellComplex& parent, std::span<const CellId> cells, const CancellationToken& cancel = {});

/// One step at one vertex. Row v: the child vertex of what joins v to it (the vertex itself, an edge, a face or a cell)
/// from the parent's vertices. REQUIRES: hexahedra, all of which touch the vertex, and it is complete.
Stencils refine_star(const CellComplex& star, VertexId vertex);

/// The vertex of the parent that a child vertex lies towards, seen from `vertex`: itself, the other end of the edge, or
/// the opposite corner of the face or cell in which the child vertex is. REQUIRES: hexahedra.
VertexId seen_from(const CellComplex& parent, const Refinement& refined, VertexId child, VertexId vertex);

/// True if the vertex lies on a straight EE (see above). REQUIRES: complete.
bool on_straight_extraordinary_edge(const CellComplex& complex, VertexId vertex);

}  // namespace ccslice
