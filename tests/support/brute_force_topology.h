// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells, faces, edges and vertices of a small mesh of hexahedra, tetrahedra and wedges, found by sorting vertex ids and
// nothing else: slow, plain, and written without looking at the core's half-face complex.
//
// A mesh may be CUT OUT of a larger one. So every cell says which of its faces lie on the boundary of the whole mesh
// (BruteCell::boundary_faces); any other face with one cell is a cut face. Something is COMPLETE when everything that
// touches it in the whole mesh is there: only then may a subdivision rule be applied to it.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice::oracle {

inline constexpr std::uint32_t kNone = 0xffffffffu;

/// Corners, edges and faces of a cell kind. Faces of hexes: u=0, u=1, v=0, v=1, w=0, w=1. Face corners run
/// counter-clockwise seen from outside a cell with a positive corner Jacobian.
struct KindTables {
  int corners = 0;
  std::vector<std::array<int, 2>> edges;
  std::vector<std::vector<int>> faces;
  std::vector<std::vector<int>> face_edges;  // Indices into `edges`.
};
const KindTables& tables(CellKind kind);

/// VTK corner of a hex at corner bits u + 2v + 4w.
inline constexpr std::array<int, 8> kVtkCorner = {0, 1, 3, 2, 4, 5, 7, 6};
/// Corner bits of a VTK corner (the map is its own inverse).
inline constexpr std::array<int, 8> kCornerBits = kVtkCorner;

/// Where a cell comes from: control cell, for cells of tets and wedges the corner of the child (the ROOT is that child,
/// otherwise the control cell itself), and the box [ijk, ijk + 1] * 2^-level in the root's frame.
struct Ancestry {
  std::uint32_t control_cell = 0;
  int child = -1;
  int level = 0;
  std::array<std::uint32_t, 3> ijk = {0, 0, 0};
};

struct BruteCell {
  CellKind kind = CellKind::kHex;
  std::array<std::uint32_t, 8> v{};  // VTK order.
  std::uint32_t boundary_faces = 0;  // Bit f: local face f is on the boundary of the whole mesh.
  Ancestry from;
};

/// Lists of ids, one list per item.
class Incidence {
 public:
  /// (item, id) pairs in any order, duplicates allowed: each list comes out sorted and without duplicates.
  Incidence(std::size_t items, std::vector<std::array<std::uint32_t, 2>> pairs);
  Incidence() = default;
  std::span<const std::uint32_t> operator[](std::uint32_t item) const {
    return {ids_.data() + begin_[item], ids_.data() + begin_[item + 1]};
  }

 private:
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> ids_;
};

struct BruteFace {
  std::array<std::uint32_t, 4> v{kNone, kNone, kNone, kNone};  // In the first cell's order; kNone closes a triangle.
  std::array<std::uint32_t, 2> cells{kNone, kNone};
  int first_local = 0;  // Local face of cells[0].
  bool boundary = false;
  int corners() const { return v[3] == kNone ? 3 : 4; }
  bool complete() const { return boundary || cells[1] != kNone; }
};

struct BruteTopology {
  std::vector<BruteFace> faces;
  std::vector<std::array<std::uint32_t, 2>> edges;  // Vertices, ascending.
  std::vector<std::array<std::uint32_t, 6>> cell_faces;
  std::vector<std::array<std::uint32_t, 12>> cell_edges;
  Incidence edge_faces, edge_cells;
  Incidence vertex_edges, vertex_faces, vertex_cells;

  bool edge_complete(std::uint32_t edge) const;
  bool vertex_complete(std::uint32_t vertex) const;
  bool edge_on_boundary(std::uint32_t edge) const;
  bool vertex_on_boundary(std::uint32_t vertex) const;
};

BruteTopology build_topology(const std::vector<BruteCell>& cells, std::size_t vertex_count);

}  // namespace ccslice::oracle
