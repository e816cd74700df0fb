// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which physical groups and which volume of the geometry the cells of a Gmsh file belong to [Gmsh reference manual, MSH
// file format]. In version 2 every element names a group and a volume; in 4.1 the volume, whose groups $Entities or
// $PartitionedEntities lists.

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/mesh_files/gmsh_scanner.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

class GmshGroups {
 public:
  /// Between the names of their sections and the ends. Throw Error{kFileSyntax}.
  /// In version 2.0 names may come without dimensions.
  void read_names(GmshScanner& scanner, bool with_dimensions);
  void read_entities(GmshScanner& scanner, bool partitioned);

  /// The next cell is of this volume and, in version 2, of this group; 0: of none.
  void add_cell(std::int64_t volume, std::int64_t group);
  /// Whether the last cell is of this volume and stands in another group; false without a volume or a group.
  bool may_take_last_cell(std::int64_t volume, std::int64_t group) const;
  /// The last cell belongs to this group, too.
  void add_last_cell_to(std::int64_t group);

  /// Hands over a set for each group of volumes that has cells, and the numbers "entity" of the volumes. Names of all
  /// other groups are left out with a warning. Throws Error{kMeshTooLarge} where groups repeat cells without end.
  void finish(MeshFile& file);

 private:
  void read_name_of_version_2_0(TextScanner& text);
  struct Group {
    std::int64_t dimension;
    std::int64_t tag;
    std::string name;
  };
  struct Volume {
    std::int64_t parent = 0;  // Of a part of a partitioned volume.
    std::vector<std::int64_t> groups;
  };
  struct Membership {
    std::uint32_t cell;
    std::int64_t group;
  };
  using CellsOfTags = std::map<std::int64_t, std::vector<std::uint32_t>>;
  void read_entity(GmshScanner& scanner, int dimension, bool partitioned);
  CellNumbers entities() const;
  CellsOfTags cells_of_tags() const;
  void add_sets(const CellsOfTags& cells_of, MeshFile& file) const;

  std::vector<Group> groups_;  // That have names.
  std::map<std::int64_t, Volume> volumes_;
  std::vector<std::int64_t> cell_volumes_;
  std::vector<Membership> memberships_;  // That stand with the elements, in the order of the cells.
};

}  // namespace ccslice
