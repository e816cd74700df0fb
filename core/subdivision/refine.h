// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One step of Catmull-Clark refinement of solids, of those cells that need it. The rules are refine_rules.h's.

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

}  // namespace ccslice
