// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The nodes that second-order cells have between their corners, by the edges, quadrilaterals and hexahedra that they
// belong to: cells that share an edge share its node, so a mesh with them has no cracks.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Where the nodes of a cell's edges, or of its quadrilaterals, lie: corners in VTK's order, in the order of
/// SecondOrderCells.
std::span<const std::array<std::uint8_t, 2>> mid_edges(CellKind kind);
std::span<const std::array<std::uint8_t, 4>> mid_faces(CellKind kind);

/// The node of an edge, of a quadrilateral (vertices in any order) or of a cell, in the order of MidNodes::positions.
std::optional<std::size_t> edge_node(const MidNodes& nodes, std::array<std::uint32_t, 2> vertices);
std::optional<std::size_t> face_node(const MidNodes& nodes, std::array<std::uint32_t, 4> vertices);
std::optional<std::size_t> cell_node(const MidNodes& nodes, std::uint32_t cell);

/// Nodes by their keys, as they come.
class MidNodeList {
 public:
  explicit MidNodeList(std::size_t channels) : channels_(channels) {}

  /// A node as it comes. `values`: as many as there are channels. `number`: of the file (FileNumbers::mid_nodes).
  struct Source {
    Vec3 position;
    std::span<const float> values;
    std::uint64_t number = 0;
  };
  /// `vertices` in any order.
  void add_edge(std::array<std::uint32_t, 2> vertices, const Source& source);
  void add_face(std::array<std::uint32_t, 4> vertices, const Source& source);
  void add_cell(std::uint32_t cell, const Source& source);
  /// All nodes of `nodes` with their `numbers` (or none), their vertices and cells renumbered. Nodes of left-out ones
  /// (kNone) are left out, and those of edges and faces two of whose vertices have become one.
  void add(const MidNodes& nodes, std::span<const std::uint64_t> numbers, std::span<const std::uint32_t> new_vertices,
           std::span<const std::uint32_t> new_cells);
  /// Node `node` of `nodes`, which has `channels` channels.
  static Source source_of(const MidNodes& nodes, std::span<const std::uint64_t> numbers, std::size_t channels,
                          std::size_t node) {
    return {nodes.positions[node], std::span(nodes.values).subspan(node * channels, channels),
            numbers.empty() ? 0 : numbers[node]};
  }

  struct Result {
    MidNodes nodes;
    std::vector<std::uint64_t> numbers;  // By node.
    /// Edges, faces and cells with nodes that are farther apart: the first one, which is taken, in the order of
    /// MidNodes::positions, and how far others are away from it, mm.
    std::vector<std::pair<std::size_t, double>> conflicts;
    double farthest_apart_mm = 0;  // In these.
    std::size_t shared = 0;        // Nodes that came more than once.
    std::size_t other_values = 0;  // Edges, faces and cells with nodes that disagree in a channel: likewise.
  };
  /// `same_mm`: how far apart nodes of one key may be.
  Result finish(double same_mm = 0) const;

 private:
  struct Node {
    std::array<std::uint32_t, 5> key;  // How many vertices, or 0 for a cell; then the sorted vertices, or the cell.
    std::uint32_t index;
    double apart_mm = 0;    // How far others of that key are away.
    bool disagree = false;  // They have other values.
    bool shared = false;    // There are others.
  };

  void add(std::array<std::uint32_t, 5> key, const Source& source);
  std::uint32_t& place_of(const std::array<std::uint32_t, 5>& key);
  void grow();

  std::size_t channels_;
  std::vector<Node> nodes_;            // Each key once, as most nodes come with several cells.
  std::vector<std::uint32_t> places_;  // A hash table of indices into the nodes, kNone where it is empty.
  std::vector<Vec3> positions_;
  std::vector<float> values_;
  std::vector<std::uint64_t> numbers_;
};

/// Whether cells of `mesh` say of so many of their common nodes that they lie far apart that they list them in another
/// order than their format's.
bool is_another_order(const ControlMesh& mesh, const MidNodeList::Result& result);

/// Tells the user about such an order. `farthest_apart_mm` and `places` are those of the conflicts.
std::string other_order_text(double farthest_apart_mm, std::size_t places);

/// The corners of what mid-nodes lie on. REQUIRES: the mesh outlives it, and each of its mid-nodes is of a cell that it
/// has.
class MidNodeCorners {
 public:
  explicit MidNodeCorners(const ControlMesh& mesh);
  /// `node`: in the order of MidNodes::positions.
  std::span<const std::uint32_t> operator[](std::size_t node) const;

 private:
  const ControlMesh& mesh_;
  std::vector<std::uint32_t> first_corners_;  // Of the cells with a node.
};

/// Makes mid_nodes of second_order, which is emptied; none if the cells' nodes contradict each other. What is said of
/// several nodes on one edge goes to the warnings.
/// REQUIRES: the cells' vertices and nodes exist.
void take_mid_nodes(MeshFile& file);

}  // namespace ccslice
