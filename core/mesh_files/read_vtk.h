// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Legacy VTK files, ASCII and binary, DATASET UNSTRUCTURED_GRID, versions 1.0 to 5.1 (from 5.0 on cells come as OFFSETS
// and CONNECTIVITY). Which cells are read, and how: core/mesh_files/vtk_cells.h. Points, lines and faces are left out
// and reported; all other cells are refused by type and cell id.
//
// POINT_DATA: SCALARS, VECTORS and FIELD arrays become material channels, one for each component ("name", or "name.0",
// "name.1", ... where there are several). Normals, tensors, colours, texture coordinates, ids and strings are left out
// and reported. Of CELL_DATA the first eight arrays of one number a cell become MeshFile::cell_numbers; the others are
// left out and reported.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error{kFileSyntax, kFileUnsupported, kMeshNonFinite, kMeshTooLarge, kMeshUnsupportedCell, kMeshBadChannel,
/// kMeshIndexOutOfRange}; messages name the line (in binary files the byte) and the token, or the cells.
MeshFile read_vtk(std::string_view text, const MeshLimits& limits = {});

}  // namespace ccslice
