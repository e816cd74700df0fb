// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One step of Catmull-Clark refinement of solids, of those cells that need it. The rules are refine_rules.h's.
//
// refine() makes all children at once. A complex takes ten times what its points do, so where children are many they
// are numbered together, and then made in cut-outs, one after the other: in each, cells, faces, edges and vertices are
// in the order that they have among all children.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/refine_rules.h"
#include "core/subdivision/stencils.h"

namespace ccslice {

/// Where child vertices come from: the parent's vertex, edge, face or cell of each.
struct ChildOrigins {
  std::array<std::uint32_t, 3> begins{};  // Of edge, face and cell points, after those of vertices.
  std::vector<std::uint32_t> origin;

  std::uint32_t count() const { return static_cast<std::uint32_t>(origin.size()); }
};

/// The child vertices that the children of some cells need, and those next to them, numbered.
struct ChildVertices : ChildOrigins {
  std::vector<VertexId> of_vertex, of_edge, of_face, of_cell;  // kNone where there is none.

  ChildVertices(const CellComplex& parent, std::span<const CellId> cells);

 private:
  template <typename Ids, typename Wanted>
  void number(std::vector<VertexId>& children, Ids items, Wanted wanted);
};

/// Child vertices from the parent's vertices. REQUIRES: complex and origins outlive it.
class ChildRules {
 public:
  ChildRules(const CellComplex& parent, const ChildOrigins& children)
      : parent_(parent), children_(children), row_(parent) {}

  /// A row for each of `count` child vertices. Throws Error{kCancelled}.
  Stencils rows(std::uint32_t first, std::uint32_t count, const CancellationToken& cancel);

 private:
  const CellComplex& parent_;
  const ChildOrigins& children_;
  RuleRow row_;
};

/// Some of the children, as a complex of hexahedra.
struct CutOut {
  CellComplex complex;
  std::vector<VertexId> numbers;    // By vertex, ascending: which of the child vertices it is.
  std::vector<CellId> first_child;  // By refined cell: its children follow in the order of its corners.
};

/// Makes cut-outs. Keeps scratch memory for each of the parent's and of the child vertices. REQUIRES: what it is given
/// outlives it.
class CutOutMaker {
 public:
  CutOutMaker(const CellComplex& parent, const ChildVertices& children)
      : parent_(parent), children_(children), keep_(parent.vertex_count(), 0), local_(children.count(), kNone) {}

  /// For each vertex v of these cells (ascending), every child at v. REQUIRES: they are among those whose children are
  /// numbered. Throws Error{kCancelled}.
  CutOut make(std::span<const CellId> cells, const CancellationToken& cancel);

 private:
  void add_children(CellId cell, std::vector<VertexId>& corners) const;

  const CellComplex& parent_;
  const ChildVertices& children_;
  std::vector<std::uint8_t> keep_;    // By the parent's vertices.
  std::vector<std::uint32_t> local_;  // By child vertex: its number in the cut-out.
};

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
