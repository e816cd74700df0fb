// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a reader makes of a mesh file. Readers check the syntax and that ids exist; validate() says whether the cells
// make up a solid.

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice {

/// A number for each cell: regions, materials, parts, densities.
struct CellNumbers {
  std::string name;              // Of the array or its component (channels.h), or what the format calls them.
  std::vector<double> of_cells;  // By cell of the mesh.
  std::map<std::int64_t, std::string> number_names{};  // What the file calls them: nothing, or all, each once.
};

/// Cells that the file gives a name: an element set, a physical group. Sets may have cells in common.
struct CellSet {
  std::string name;
  std::vector<std::uint32_t> cells;  // Of the mesh, ascending; at least one.
};

/// What the file calls the mesh's vertices and cells, for messages: its own numbers, as its format counts.
struct FileNumbers {
  std::string vertex_noun = "vertex", cell_noun = "cell";  // One of them: "node", "point"; "element".
  std::vector<std::uint64_t> vertices;                     // By vertex of the mesh.
  std::vector<std::uint64_t> cells;                        // By cell of the mesh. A number may come more than once.
  std::vector<std::uint64_t> mid_nodes{};                  // By mid-node of the mesh: vertices of the file.
};

/// The nodes that second-order cells have beyond their corners, as vertices of the mesh; kNone where a cell lacks one.
/// A cell lists those of its edges, in the order of VTK's types 24, 25 and 26; or these, then those of its
/// quadrilaterals (hexahedra: u = 0, u = 1, v = 0, v = 1, w = 0, w = 1, with u from corner 0 to 1, v to 3, w to 4;
/// wedges: corners 0 1 4 3, 1 2 5 4, 2 0 3 5), and of hexahedra the one in the middle.
///
///   tetrahedron 6      wedge 9 or 12      hexahedron 12 or 19
struct SecondOrderCells {
  std::vector<std::uint32_t> cells;        // Of the mesh, ascending.
  std::vector<std::uint64_t> first_nodes;  // Of each cell: where its nodes begin. The last cell's end with the list.
  std::vector<std::uint32_t> nodes;
};

/// Where a file's bytes come from, for formats whose files include others.
struct FileOrigin {
  std::string path{};      // Empty: nobody knows, and nothing is included.
  std::string includes{};  // A folder that files may be included from, besides that of `path`; those below it, too.
  std::uint64_t max_bytes = std::uint64_t{8} << 30;  // Of the file with all that it includes.
};

struct MeshFile {
  ControlMesh mesh;
  std::vector<std::string> warnings;        // What the file held that was left out, a sentence each.
  std::vector<CellNumbers> cell_numbers{};  // For cell regions (cell_numbers.h) or channels (cell_averages.h).
  std::vector<CellSet> cell_sets{};         // For cell regions.
  std::vector<CellSet> cell_materials{};    // The same of the materials that sections give to elements.
  FileNumbers numbers{};
  SecondOrderCells second_order{};  // While the file is read: leave_out_unused_vertices() makes mid_nodes of them.
  std::vector<std::uint32_t> left_out_nodes{};  // Likewise: those of cells that are taken without them.
};

/// What errors say of files without volume cells, such as those of surfaces.
inline const std::string kNeedsVolumeCells = "a solid needs volume cells: mesh the inside too, as `gmsh -3` does";

}  // namespace ccslice
