// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields at the nodes of a Gmsh file ($NodeData), which become channels; those of several partitions are one [Gmsh
// reference manual, MSH file format].

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh/validate.h"
#include "core/mesh_files/gmsh_element_data.h"
#include "core/mesh_files/gmsh_scanner.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/node_numbers.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {

class GmshNodeData {
 public:
  /// Between the name of the section and its end. Throws Error{kFileSyntax, kMeshTooLarge}.
  void read(GmshScanner& scanner, const MeshLimits& limits);
  /// Hands over the fields that have a value at each corner. Others are left out with a warning. Throws
  /// Error{kMeshNonFinite} for a value of a node of cells that no channel can have. REQUIRES: the cells are there.
  void finish(const NodeNumbers& nodes, const TextScanner& text, const MeshLimits& limits, MeshFile& file) const;

 private:
  /// Values that no channel can have count rows where the others count vertices.
  struct Field {
    std::vector<NamedChannel> channels;
    std::vector<std::uint64_t> tags;  // Of the node of each row of values.
    std::string step;                 // As it is written.
    UnfitNumbers unfit;
  };
  /// Of the mesh's vertices.
  struct Used {
    std::vector<bool> corners, nodes;  // Of cells; those between corners are nodes, too.
  };
  static void read_rows(std::uint64_t count, GmshScanner& scanner, Field& field);
  static void add_field(const Field& field, const Used& used_ones, const NodeNumbers& nodes, const TextScanner& text,
                        const MeshLimits& limits, MeshFile& file);

  std::vector<Field> fields_;
  std::vector<std::string> warnings_;
};

}  // namespace ccslice
