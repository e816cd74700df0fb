// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Subdivision operators: how the control points of an irregular one-ring yield those of the cell's children.
//
// They depend on topology alone and are shared by all cells whose rings have the same key. Each is read off the
// refinement rules by refining the ring's own little complex (refine.h), so there is one statement of the rules. The
// child at the irregular corner has the same kind of ring; after at most a few steps exactly the same, and the operator
// leads to itself.
//
//   LINE      2-D, over one layer of a line ring: children (bits u + 2v) at 1, 2, 3 are regular patches of 4 x 4
//             points. Along the line nothing is refined: a line cell is (2-D scheme) x (cubic B-spline).
//   STAR      3-D: the points of the cells at an irregular vertex. They yield those of the next level without any
//             others, so one operator serves all cells at the vertex, and the limit there depends on them alone.
//   CORNER    3-D: the rest of what a vertex cell needs. Its own points and the seven outer children, which are regular
//             or line cells, follow from the cells that touch its other seven corners, and from the star's points next
//             to those one level on. However many cells meet at the vertex and however they lie, such a ring depends
//             only on the three lines that leave the vertex along the cell's edges, so few operators serve all cells,
//             tetrahedra's too, whose stars are hardly ever alike.
//   SURFACE   2-D, over the boundary surface's ring of a face.
//
// Boundary subdivision matrices are defective (Jordan blocks), so they are never diagonalized: level n is reached by n
// sparse steps, and the limit at the irregular point itself by the row e0 A A A ... carried to convergence.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/subdivision/cell_class.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/packed_stencils.h"
#include "core/subdivision/ring.h"

namespace ccslice {

/// One child's control points, among those of an operator's children.
struct ChildRows {
  std::uint32_t first = 0;  // In ChildStencils::rows.
  std::uint32_t count = 0;
  PhantomMask phantoms = 0;
  std::uint32_t op = kNone;  // The operator that the child goes on with; kNone for regular children.
};

/// How children's control points are made. Children share most of their points, and a point has one row, whoever asks
/// for it. Rows with as many entries stand together, short ones first.
struct ChildStencils {
  PackedStencils stencils;
  std::vector<std::uint32_t> rows;  // Of the points of one child after the other.

  std::span<const std::uint32_t> rows_of(const ChildRows& child) const {
    return std::span(rows).subspan(child.first, child.count);
  }
};

/// 2-D: line cells and the boundary surface. Child 0 has the irregular corner; 1, 2, 3 have 16 rows each (rows of
/// phantom points are zero and to be filled in).
struct PlanarOperator : ChildStencils {
  std::uint32_t points = 0;
  std::array<ChildRows, 4> children;
  std::vector<double> limit;  // The limit at the irregular corner: one weight per point.
};

/// 3-D: the points at a vertex, by number in its star.
struct StarOperator {
  std::uint32_t points = 0;
  PackedStencils stencils;    // Row p: the point one level on that lies towards p.
  std::vector<double> limit;  // The limit at the vertex: one weight per point.
};

/// 3-D: the ring of a vertex cell. Columns: its points shared with the star, its own, and the shared points of
/// children[0] one level on. Children by bits u + 2v + 4w: the first has rows for its own points; the others have 64
/// rows if regular, 4 layers of a 2-D ring if line cells, framed by `frame`.
struct CornerOperator : ChildStencils {
  struct Child : ChildRows {
    CellClass cell_class = CellClass::kRegular;
    Frame frame;
    std::uint32_t layer_points = 0;  // Line cells.
  };
  std::uint32_t shared = 0, own = 0;
  std::array<Child, 8> children;
  /// Shared points of children[0]: the shared point here that each lies towards.
  std::vector<std::uint32_t> carried;
};

/// The operator of a vertex cell.
struct VertexOperator {
  std::uint32_t star = 0, corner = 0;
  std::vector<std::uint32_t> shared;  // The corner operator's shared points: their numbers in the star.
};

}  // namespace ccslice
