// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of an Abaqus input file and their instances, which make up the mesh.

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/validate.h"
#include "core/mesh_files/abaqus_lines.h"
#include "core/mesh_files/abaqus_sets.h"
#include "core/mesh_files/abaqus_types.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/node_numbers.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {

/// The cells of a part.
struct AbaqusCells {
  std::vector<CellKind> kinds;
  std::vector<std::uint64_t> numbers, marks;  // Of each cell: its number, and its place in the file.
  std::vector<std::uint64_t> corners;         // Numbers of nodes.
  /// The second-order ones, ascending, and the numbers of their nodes between the corners, 0 for none.
  std::vector<std::uint32_t> second_order;
  std::vector<std::uint64_t> first_mid_nodes, mid_nodes;
  /// Those whose faces may lie on each other, ascending, and the types that they are of.
  std::vector<std::uint32_t> may_be_flat;
  std::vector<std::string_view> flat_types;

  /// `nodes` are all of the element's ones, the corners first. `name` outlives the cells.
  void add(const AbaqusSolidType& type, std::string_view name, std::uint64_t number,
           std::span<const std::uint64_t> nodes, std::uint64_t mark);
  std::span<const std::uint64_t> mid_nodes_of(std::size_t second_order_cell) const;
};

struct AbaqusPart {
  std::string name;
  NodeNumbers nodes;
  std::vector<Vec3> positions;
  UnfitNumbers unfit;
  AbaqusCells cells;

  /// Once it is in the mesh: keeps the cells' kinds and numbers alone.
  void release();
};

struct AbaqusInstance {
  std::string name;  // As names are compared.
  std::size_t part = 0;
  Placement placement = Placement::Identity();
  int lines = 0;  // Of the placement that have come.
};

/// A data line of *INSTANCE: a translation; then two points of an axis and an angle in degrees. Throws
/// Error{kFileSyntax, kMeshNonFinite} with its line.
void read_placement(AbaqusLines& lines, AbaqusInstance& instance);

/// Puts the instances into the mesh, in the order of the file, or without any the parts. What stands outside of parts,
/// which is the first part, comes before them.
class AbaqusPlacer {
 public:
  AbaqusPlacer(const AbaqusLines& lines, const MeshLimits& limits, MeshFile& file)
      : lines_(lines), limits_(limits), file_(file) {}

  /// Throws Error{kFileSyntax, kMeshTooLarge, kMeshIndexOutOfRange, kMeshNonFinite} with its line.
  void place(std::vector<AbaqusPart>& parts, const std::vector<AbaqusInstance>& instances);

  /// Valid as long as the parts are.
  const std::vector<PlacedElements>& placed() const { return placed_; }

 private:
  void leave_out_flat_cells(AbaqusPart& part);
  void add_instance(const AbaqusPart& part, std::size_t number, const AbaqusInstance& instance);
  std::uint32_t node(const AbaqusPart& part, std::uint64_t number, std::size_t cell) const;
  void add_mid_nodes(const AbaqusPart& part, std::size_t first_vertex, std::size_t first_cell, std::vector<bool>& used);

  const AbaqusLines& lines_;
  const MeshLimits& limits_;
  MeshFile& file_;
  std::vector<PlacedElements> placed_;
  std::map<std::string_view, std::uint64_t> flat_;  // Cells that are left out, by their types.
};

}  // namespace ccslice
