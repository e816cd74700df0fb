// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Brute force: refine every cell of a mesh by the subdivision rules, as they stand in the books, and read exact limit
// points off the vertices.
//
// Rules [Joy and MacCracken; DeRose et al. on the boundary; Luu19, 2]. C = mean of a cell's corners, A = mean of a
// face's, M = mean of an edge's, P = the old vertex, a bar = plain mean over the incident items of the old mesh:
//   cell point  C                          interior face point  (C0 + 2 A + C1) / 4
//   interior edge point  (Cbar + 2 Abar + (n - 3) M) / n          interior vertex  (Cbar + 3 Abar + 3 Mbar + P) / 8
//   interior vertex on a straight extraordinary edge of valence n: the product of the surface rule of valence n and the
//   cubic B-spline rule, [Cbar + Ah + 2 Av + 2 Mh + (n - 3) Mv + (n - 3) P] / (2 n), v: over the
//   faces and edges that contain the extraordinary edges, h: over the others
//   boundary face, edge, vertex  A,  (v0 + v1 + A0 + A1) / 4,  (Q + 2 R + (k - 3) P) / k
//   sharp edge  M;  boundary vertex with two sharp edges  (a + 6 P + b) / 8;  with three or more, or tagged  P
//
// Exact limit points at a vertex: interior and regular, the mask (1,4,1)/6 in three directions; boundary and smooth,
// (k^2 P + 4 sum of edge neighbours + sum of face neighbours) / (k (k + 5)); on a crease (a + 4 P + b) / 6; corners P;
// all others by refining the vertex's own cells until nothing changes.
//
// A point is a row of 3 + c doubles: position (mm) and channels, one treated as the other. What can't be known because
// a cut took part of its neighbourhood away is NaN, and NaN spreads to whatever would depend on it: a wrong value can't
// leak into a comparison.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "tests/support/brute_force_topology.h"

namespace ccslice::oracle {

inline constexpr int kMaxStride = 16;
/// Position and channels of one point.
using PointValue = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxStride, 1>;

struct BruteMesh {
  int stride = 3;
  std::vector<double> points;  // stride doubles a vertex.
  std::vector<BruteCell> cells;
  std::set<std::array<std::uint32_t, 2>> sharp_edges;  // Vertices, ascending.
  std::set<std::uint32_t> sharp_vertices;

  std::size_t vertex_count() const { return points.size() / stride; }
  PointValue point(std::uint32_t v) const { return PointValue::Map(points.data() + std::size_t{v} * stride, stride); }
  Vec3 position(std::uint32_t v) const { return Vec3(points.data() + std::size_t{v} * stride); }
};

/// REQUIRES: 3 + channel_count() <= kMaxStride.
BruteMesh to_brute_mesh(const ControlMesh& mesh);

/// What became of a mesh's items in refine(): old vertex v is new vertex v; children of cell c start at first_child[c],
/// those of a hex in the order of their corner bits u + 2v + 4w, those of a tet or wedge in the order of its corners.
struct Refined {
  BruteMesh mesh;
  std::vector<std::uint32_t> first_child;
};

Refined refine(const BruteMesh& mesh, const BruteTopology& topology);

/// Cells that have one of `vertices`, ascending.
std::vector<std::uint32_t> cells_round(const BruteMesh& mesh, std::span<const std::uint32_t> vertices);
std::vector<std::uint32_t> cells_round(const BruteTopology& topology, std::span<const std::uint32_t> vertices);

/// Some cells of a mesh as a mesh of their own. `vertices`: old ids, ascending; a vertex's place there is its new id.
struct CutOut {
  BruteMesh mesh;
  std::vector<std::uint32_t> vertices;
  std::uint32_t vertex(std::uint32_t old) const;  // REQUIRES: it is kept.
};
CutOut cut_out(const BruteMesh& mesh, std::span<const std::uint32_t> cells);

/// True if limit_point() has a closed form.
bool has_limit_mask(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t vertex);

/// Limit position and channels at a vertex; NaN if the vertex isn't complete.
PointValue limit_point(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t vertex);

/// A cell with its one-ring (the cells that share a vertex with it): enough for everything about the cell's limit, and
/// closed under going to one of its children. So parameters of 2^-16 and less cost no more than a few cells a level.
class OneRing {
 public:
  /// `focus`: id in `mesh`.
  OneRing(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t focus);

  /// Child i of the focus (order as in Refined), with its one-ring.
  OneRing child(int i) const;

  const BruteMesh& mesh() const { return mesh_; }
  const BruteTopology& topology() const { return topology_; }
  const BruteCell& focus() const { return mesh_.cells[focus_]; }
  PointValue limit_at_corner(int vtk_corner) const { return limit_point(mesh_, topology_, focus().v[vtk_corner]); }
  bool mask_at_corner(int vtk_corner) const { return has_limit_mask(mesh_, topology_, focus().v[vtk_corner]); }
  /// The limit at the focus's parametric centre. REQUIRES: a hex.
  PointValue limit_at_centre() const;

 private:
  OneRing(const BruteMesh& mesh, const std::vector<std::uint32_t>& cells, std::uint32_t focus);

  BruteMesh mesh_;
  BruteTopology topology_;
  std::uint32_t focus_ = 0;
};

}  // namespace ccslice::oracle
