// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields at the elements of a Gmsh file ($ElementData), which become numbers of cells, and the header that they have in
// common with fields at nodes [Gmsh reference manual, MSH file format].

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh_files/gmsh_scanner.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/node_numbers.h"

namespace ccslice {

/// What stands before the values of a field.
struct GmshFieldHeader {
  std::string name = "field";
  std::string step;  // As it is written.
  std::uint64_t components = 0;
  std::uint64_t count = 0;      // Of nodes or elements with values.
  std::uint64_t partition = 0;  // 0: of the whole mesh.
};

/// Behind the name of the section. Throws Error{kFileSyntax}, Error{kMeshTooLarge} for more than `most` values.
GmshFieldHeader read_field_header(GmshScanner& scanner, std::uint64_t most);

class GmshElementData {
 public:
  /// Between the name of the section and its end.
  void read(GmshScanner& scanner);
  /// Hands over the components of fields that have numbers for each cell. Others are left out with a warning. REQUIRES:
  /// file.numbers has the cells' ones.
  void finish(MeshFile& file) const;

 private:
  struct Field {
    std::string name, step;
    std::uint64_t components;
    std::vector<std::uint64_t> elements;
    std::vector<double> values;  // All components of an element, then of the next one.
  };
  Field* to_take(const GmshFieldHeader& header);
  static void hand_over(const Field& field, const NodeNumbers& elements, MeshFile& file);

  std::vector<Field> fields_;
  std::vector<std::string> warnings_;
};

}  // namespace ccslice
