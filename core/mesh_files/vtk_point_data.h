// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The attribute part of a legacy VTK file: what follows POINT_DATA or CELL_DATA.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh_files/vtk_scanner.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {

struct VtkAttributes {
  std::vector<NamedChannel> channels;
  std::vector<std::string> left_out;  // Names of arrays that make no channels.
};

/// Reads point data of `count` tuples each, up to the next section of the file. Values that no channel can have go to
/// `unfit`. Throws Error{kFileSyntax, kMeshTooLarge}.
VtkAttributes read_vtk_attributes(VtkScanner& scanner, std::uint64_t count, std::size_t max_channels,
                                  UnfitNumbers& unfit);

/// Cell data: the first arrays that have numbers for each cell are kept, component by component.
struct VtkCellData {
  std::vector<CellNumbers> numbers;   // By cell of the file.
  std::vector<std::string> left_out;  // Names of all other arrays.
};
/// Reads cell data of `count` cells, up to the next section of the file. Throws Error{kFileSyntax}.
VtkCellData read_vtk_cell_data(VtkScanner& scanner, std::uint64_t count);

/// Passes over a FIELD whose keyword has been taken.
void skip_field(VtkScanner& scanner);

}  // namespace ccslice
