// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the cells round an edge or a vertex are what a solid has there.

#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/mesh/cell_complex.h"

namespace ccslice {

class ManifoldTest {
 public:
  explicit ManifoldTest(const CellComplex& complex) : complex_(complex) {}

  /// The edge's cells form one ring, or one fan between two faces of the boundary.
  bool holds_at(EdgeId edge);
  /// The vertex's cells form one ball or one half-ball: the link is connected and its Euler characteristic that of a
  /// sphere or a disc.
  bool holds_at(VertexId vertex);

 private:
  /// How many cells are reached from the first one, across faces that pass `through`.
  template <typename Through>
  std::size_t reachable(std::span<const CellId> cells, Through through);

  const CellComplex& complex_;
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

}  // namespace ccslice
