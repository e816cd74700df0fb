// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// OpenVolumeMesh .ovm, ASCII (the header may leave that word out): Vertices, Edges, Faces and Polyhedra, each a
// keyword, a count and as many entries. Ids count from 0. An edge is two vertices, a face its half-edges (2 e runs
// along edge e, 2 e + 1 against it), a cell its half-faces (2 f is face f, 2 f + 1 the same one seen from the other
// side) [openvolumemesh.org, Text-based File Format].
//
// Properties follow: a line `VProp float "name"`, then a line for each vertex. Those of vertices of the types int,
// uint, short, ushort, long, ulong, bool, float and double become material channels; so do vectors of them (vec2f ...
// vec4d), one channel for each component ("name.0", "name.1", ...). Those of cells (CProp) of the same types become
// MeshFile::cell_numbers, the first kMostCellNumbers of them; OpenVolumeMesh writes and reads them like those of
// vertices, a line for each cell in the order of Polyhedra [src/OpenVolumeMesh/FileManager/FileManagerT_impl.hh]. All
// others are left out and reported. Refused: polyhedra that are neither hexahedra nor tetrahedra nor wedges nor
// pyramids (which core/mesh_import/collapsed_cells.h halves), and the binary kind .ovmb.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error{kFileSyntax, kFileUnsupported, kMeshNonFinite, kMeshTooLarge, kMeshUnsupportedCell,
/// kMeshIndexOutOfRange, kMeshEmpty}; messages name the line and the token, or the cell.
MeshFile read_ovm(std::string_view text, const MeshLimits& limits = {});

}  // namespace ccslice
