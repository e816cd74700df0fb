// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells of second order and higher in MEDIT files. The format leaves the order of their nodes to who writes it:
// sections such as HexahedraQ2Ordering list the indices of each node in the cell, (i, j, k) of a hexahedron,
// barycentric ones of a tetrahedron, barycentric ones and a height of a prism [libMeshb 7, GmfSetHONodesOrdering,
// test_libmeshb_hexq2.c]. Without them the corners come first; the six nodes of a tetrahedron's edges then follow in
// VTK's order, as Gmsh and SMESH have them, and those of other cells belong to the edges and faces whose middles they
// are near.

#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/mesh_files/medit_sections.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

class MeditHighOrder {
 public:
  /// The next cells of the mesh are of this section; `nodes` are those of its cells.
  void add(const MeditCells& section, std::uint32_t first_cell, std::vector<std::uint32_t> nodes);
  /// Whether the keyword is that of an ordering of cells, which is read then, behind the keyword. Throws
  /// Error{kFileSyntax}.
  bool read_ordering(const std::string& keyword, TextScanner& scanner);
  /// Puts the corners into the cells in their order, hands over the nodes of those of second order, and notes how many
  /// cells there are. Throws Error{kMeshIndexOutOfRange} for nodes that aren't there. REQUIRES: the mesh has the cells,
  /// and this is the last call.
  void finish(MeshFile& file);

 private:
  struct Section {
    const MeditCells* cells;
    std::uint32_t first_cell;
    std::vector<std::uint32_t> nodes;
    std::size_t count() const { return nodes.size() / cells->nodes; }
  };
  std::vector<std::uint8_t> order_of(const Section& section, const MeshFile& file) const;

  std::vector<Section> sections_;
  std::map<std::string_view, std::vector<std::uint8_t>> orderings_;  // By the cells' keyword: see order_of().
};

}  // namespace ccslice
