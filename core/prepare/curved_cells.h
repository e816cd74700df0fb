// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Second-order cells of a mesh that is taken as meshed (ControlMesh::mid_nodes), as tricubic patches.
//
// A second-order hexahedron is a polynomial of degree 2 along each axis, given by its values at 3 x 3 x 3 places. Where
// it has no node, the place has
//
//   edge      (a + b) / 2                            a, b: its ends
//   face      (e1 + e2 + e3 + e4) / 2 - (c1 + c2 + c3 + c4) / 4     e: nodes of its edges, c: its corners
//   middle    (sum of faces) / 2 - (sum of edges) / 4 + (sum of corners) / 8
//
// which is what serendipity cells (of 20 nodes) are there. A tetrahedron of 10 nodes, a polynomial of degree 2 of its
// barycentric coordinates, consists of four hexahedra, one at each corner, over which these coordinates are trilinear:
// so it is of degree 2 along each axis of those. A wedge of 15 or 18 nodes consists of six likewise.
//
// A cubic B-spline has every polynomial of degree 2, f(t) with f(0) = a, f(1/2) = m, f(1) = b, by the control points
//
//   (16 a - 20 m + 7 b) / 3,  (a + 4 m - 2 b) / 3,  (-2 a + 4 m + b) / 3,  (7 a - 20 m + 16 b) / 3,
//
// its blossom at (-2,-1,0), (-1,0,1), (0,1,2) and (1,2,3).
//
// Private to core/limit.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

/// REQUIRES: what it is given outlives it.
class CurvedCells {
 public:
  /// `origins`: by vertex of `mesh`, the vertex that mid_nodes know it by; empty if it is the same. `values`: the
  /// channels of those, vertex-major. Where a corner has another value of a channel, as it does where channels jump
  /// from one cell region to another, nodes beside it have the mean of their corners' values.
  CurvedCells(const ControlMesh& mesh, std::span<const std::uint32_t> origins, std::span<const float> values);

  bool any() const { return mesh_.as_meshed && !mesh_.mid_nodes.empty(); }
  /// The cell has a node on an edge, on a face or in its middle.
  bool is_curved(ControlCellId cell) const { return any() && curved_[cell] != 0; }

  /// Control points of the patch of a cell's child: 4 x 4 x 4 times (x, y, z, channels), index i + 4 j + 16 k.
  /// `child`: the corner of a tetrahedron or wedge at which it is; 0 for a hexahedron, which is its own.
  std::vector<double> patch(ControlCellId cell, std::size_t child) const;
  /// Control points, 4 x 4, of a patch's side, framed by its corners (bits u + 2v + 4w) at (s,t) = (0,0), (1,0), (1,1).
  std::vector<double> side(std::span<const double> patch, const std::array<std::uint8_t, 3>& corners) const;

  /// Bounds of each channel over all curved cells, by their Bezier points. Throws Error{kCancelled}.
  std::vector<std::pair<double, double>> channel_ranges(const CancellationToken& cancel) const;

 private:
  class Nodes;

  std::span<const std::uint32_t> corners(ControlCellId cell) const;
  std::uint32_t original(std::uint32_t vertex) const;
  std::optional<std::size_t> node_of_edge(std::array<std::uint32_t, 2> vertices) const;
  std::optional<std::size_t> node_of_face(std::array<std::uint32_t, 4> vertices) const;
  std::vector<double> values_of_child(ControlCellId cell, std::size_t child) const;

  const ControlMesh& mesh_;
  std::span<const std::uint32_t> origins_;
  std::span<const float> values_;
  std::size_t dimension_;
  std::vector<std::uint32_t> first_corners_;  // By cell.
  std::vector<std::uint8_t> curved_;          // By cell.
};

}  // namespace ccslice
