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
//   VERTEX    3-D: the seven outer children are regular or line cells.
//   SURFACE   2-D, over the boundary surface's ring of a face.
//
// Boundary subdivision matrices are defective (Jordan blocks), so they are never diagonalized: level n is reached by n
// sparse steps, and the limit at the irregular point itself by the row e0 A A A ... carried to convergence.

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/subdivision/cell_class.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/stencils.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

/// Rows of one child's control points within an operator's stencils.
struct ChildRows {
  std::uint32_t first_row = 0;
  std::uint32_t count = 0;
  PhantomMask phantoms = 0;
  std::uint32_t op = kNone;  // The operator that the child goes on with; kNone for regular children.
};

/// 2-D: line cells and the boundary surface. Child 0 has the irregular corner; 1, 2, 3 have 16 rows each (rows of
/// phantom points are zero and to be filled in).
struct PlanarOperator {
  std::uint32_t points = 0;
  Stencils stencils;
  std::array<ChildRows, 4> children;
  std::vector<double> limit;  // The limit at the irregular corner: one weight per point.
};

/// 3-D. Children by bits u + 2v + 4w; 64 rows if regular, 4 layers of a 2-D ring if a line cell, framed by `frame`.
struct VertexOperator {
  struct Child : ChildRows {
    CellClass cell_class = CellClass::kRegular;
    Frame frame;
    std::uint32_t layer_points = 0;  // Line cells.
  };
  std::uint32_t points = 0;
  Stencils stencils;
  std::array<Child, 8> children;
  std::vector<double> limit;
};

class OperatorTable {
 public:
  /// The operator of a ring, made if it isn't known yet.
  std::uint32_t line(const LineRing& ring);
  std::uint32_t vertex(const VertexRing& ring);
  std::uint32_t surface(const SurfaceRing& ring);

  const std::vector<PlanarOperator>& lines() const { return lines_; }
  const std::vector<VertexOperator>& vertices() const { return vertices_; }
  const std::vector<PlanarOperator>& surfaces() const { return surfaces_; }

  std::size_t memory_bytes() const { return bytes_; }
  /// Largest number of control points of any ring (all layers of a line ring counted).
  std::uint32_t max_ring_points() const;

 private:
  using Key = std::vector<std::uint32_t>;
  std::map<Key, std::uint32_t> line_index_, vertex_index_, surface_index_;
  std::vector<PlanarOperator> lines_, surfaces_;
  std::vector<VertexOperator> vertices_;
  std::size_t bytes_ = 0;
};

}  // namespace ccslice
