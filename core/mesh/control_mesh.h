// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The control mesh of a Catmull-Clark solid as a user gives it: control points with positions (mm) and material
// channels, cells of mixed kinds, regions of cells, sharp edges and vertices. Plain data, no invariants: validate() in
// core/mesh/validate.h checks it, and everything downstream takes only validated meshes.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/types.h"
#include "core/mesh/cell_kind.h"

namespace ccslice {

/// A vertex that the fit of an interpolating mesh missed, and where it was to be, mm.
struct MissedVertex {
  std::uint32_t vertex = 0;
  Vec3 position = Vec3::Zero();
};

/// Nodes of second-order cells between their corners: of edges, of quadrilaterals, of hexahedra. They count in meshes
/// that are taken as meshed only.
struct MidNodes {
  std::vector<std::array<std::uint32_t, 2>> edges;  // By their two vertices, the lesser first. Ascending, each once.
  std::vector<std::array<std::uint32_t, 4>> faces;  // Quadrilaterals by their vertices, ascending. Likewise.
  std::vector<std::uint32_t> cells;                 // Hexahedra. Ascending, each once.
  std::vector<Vec3> positions;                      // Of the edges, then of the faces, then of the cells, mm.
  std::vector<float> values;                        // c for each, node-major.

  bool empty() const { return positions.empty(); }
};

struct ControlMesh {
  std::vector<Vec3> positions;                            // n vertices, mm.
  std::vector<std::string> channel_names;                 // c >= 0, distinct, not empty.
  std::vector<float> channel_values;                      // n * c, vertex-major: value[v * c + channel].
  std::vector<CellKind> cell_kinds;                       // One per cell.
  std::vector<std::uint32_t> cell_vertices;               // Corners of all cells, one cell after the other.
  std::vector<std::array<std::uint32_t, 2>> sharp_edges;  // Boundary edges by their two vertices, in any order.
  std::vector<std::uint32_t> sharp_vertices;              // Boundary vertices that stay where they are (corners).
  /// Named groups of cells with a sharp interface between them. None: the whole mesh is one, without a name.
  std::vector<std::string> cell_region_names;  // Distinct, not empty.
  std::vector<std::uint8_t> cell_regions;      // One per cell if there are names: an index into them. Else empty.
  /// Channels that jump across interfaces: k pairs of a vertex and one of its regions, ascending, and the c values that
  /// it has there, pair-major. Where a region has none, channel_values holds.
  std::vector<std::uint32_t> region_value_vertices;
  std::vector<std::uint8_t> region_value_regions;
  std::vector<float> region_values;
  bool allow_folds = false;  // Inverted cells become a warning instead of an error.
  /// The control points were fitted: the mesh that is meant is that of the vertices' limit points, with these cells.
  bool interpolating = false;
  /// ... but for these, which are meant to be elsewhere. Ascending, each vertex once; none unless interpolating.
  std::vector<MissedVertex> missed_vertices;

  /// The solid is the mesh itself, as finite elements have it: cells with straight edges, or second-order ones where
  /// there are mid-nodes, and channels that are continuous, and of the cells' order within them. Nothing is sharp then.
  bool as_meshed = false;
  MidNodes mid_nodes;

  std::size_t vertex_count() const { return positions.size(); }
  std::size_t cell_count() const { return cell_kinds.size(); }
  std::size_t channel_count() const { return channel_names.size(); }
};

/// Calls change(place) for the places of all vertices and mid-nodes, and for those of missed vertices, mm.
template <typename Change>
void for_each_place(ControlMesh& mesh, Change change) {
  for (Vec3& place : mesh.positions) change(place);
  for (Vec3& place : mesh.mid_nodes.positions) change(place);
  for (MissedVertex& missed : mesh.missed_vertices) change(missed.position);
}

}  // namespace ccslice
