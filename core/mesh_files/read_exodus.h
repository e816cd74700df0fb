// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Exodus II files in netCDF's classic format [Schoof, Yarberry, EXODUS II: A finite element data model; exodusII_int.h
// for the names]. Those in HDF5's container are netCDF-4, which netCDF's nccopy turns into the classic one.
//
// Element blocks become MeshFile::cell_sets with their names, or their ids where they have none, and the ids its
// numbers "block". Element sets are sets too. The nodes of cells of second order become MeshFile::second_order, and the
// file's own numbers (node_num_map, elem_num_map) its numbers. Points, lines, faces and shells are left out. Variables
// at nodes become channels, those at elements numbers of cells: the values of the last time step.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error (kFileSyntax, kFileUnsupported, kMeshTooLarge, kMeshNonFinite, kMeshUnsupportedCell,
/// kMeshIndexOutOfRange, kMeshEmpty), which names the byte, the variable or the block.
MeshFile read_exodus(std::string_view bytes, const MeshLimits& limits = {});

}  // namespace ccslice
