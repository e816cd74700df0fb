// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Gmsh .msh files of versions 2 and 4.1, ASCII and binary, as Gmsh's reference manual has them ("MSH file format").
//
// Sections that nobody knows may stand anywhere. Nodes have tags, in any order and with gaps; those that no volume cell
// uses are left out. The nodes of cells of second order become MeshFile::second_order; cells of higher order keep their
// corners. Points, lines and faces are left out. Physical groups of volumes become MeshFile::cell_sets, and the numbers
// of the volumes its numbers "entity". Fields at nodes ($NodeData) become channels; those of several partitions are
// one.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error (kFileSyntax, kFileUnsupported, kMeshTooLarge, kMeshNonFinite, kMeshUnsupportedCell,
/// kMeshIndexOutOfRange, kMeshEmpty), which names the line, or the byte in a binary file.
MeshFile read_gmsh(std::string_view bytes, const MeshLimits& limits = {});

}  // namespace ccslice
