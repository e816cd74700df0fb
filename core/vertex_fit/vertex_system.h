// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The sparse system between the control points of a mesh and the limit points of its vertices (limit_masks.h): S P = L.
//
// Limit points of the boundary depend on control points of the boundary alone, so S falls into blocks, and is solved
// block by block: the boundary's, a Catmull-Clark surface, then the interior's. Regular rows have eigenvalues from 1/9
// to 1 on a surface and from 1/27 in a volume, so a few dozen steps of BiCGSTAB do. Some meshes are SINGULAR: no
// control points of a smooth single cube have a limit that takes in every second corner only. There the system is
// solved in the least-squares sense, with the smallest moves.

#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/mesh/cell_complex.h"

namespace ccslice {

class VertexSystem {
 public:
  /// A row for each vertex, a column for each quantity.
  using Values = Eigen::MatrixXd;

  /// REQUIRES: no cut-out. Throws Error{kCancelled}, as all that follows does.
  explicit VertexSystem(const CellComplex& complex, const CancellationToken& cancel = {});

  bool on_boundary(std::size_t vertex) const { return inside_from_[vertex] == kNone; }

  /// Limit points of control points.
  Values limits(const Values& points) const;

  /// Moves of control points by which all limit points move like that, to 1e-10 of the largest column's norm.
  Values solve(const Values& moves) const;
  /// Moves by which the limit points of the boundary move like that, to 1e-10 likewise. Control points inside follow
  /// those around them: harmonic, by the graph of the edges.
  Values solve_boundary(const Values& moves) const;

 private:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  void number(const CellComplex& complex);
  void build_masks(const CellComplex& complex);
  void build_graph(const CellComplex& complex);
  Values solve_surface(const Values& moves) const;
  Values join(const Values& surface, const Values& inside) const;

  CancellationToken cancel_;
  std::vector<std::uint32_t> surface_from_, inside_from_;  // By vertex: its row in the block, or kNone.
  std::vector<std::uint32_t> surface_, inside_;            // Vertices, by row.
  Matrix masks_surface_, masks_inside_, masks_inside_surface_;
  Matrix graph_inside_, graph_inside_surface_;  // Laplacian of the edges, rows of interior vertices.
};

}  // namespace ccslice
