// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// VTK's XML files of unstructured grids, .vtu [VTK XML Formats]: arrays as text, in base64 or appended (raw or base64),
// plain or compressed with zlib, LZ4 or LZMA, in either byte order. Cells and point data become what they do in legacy
// files (core/mesh_files/read_vtk.h).
//
// PIECES are read one after another. Points that they share are joined later (core/mesh_import/join_points.h). Cells
// that VTK marks as copies of another piece's (vtkGhostType) are left out. A channel has to be in every piece.
//
// PARTITIONS: a .pvtu names a .vtu for each piece. They are read in its order as if they were pieces of one file, and
// so are points and cells counted.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error{kFileSyntax, kFileUnsupported, kMeshNonFinite, kMeshTooLarge, kMeshUnsupportedCell,
/// kMeshIndexOutOfRange, kMeshEmpty}; messages name the byte (of encoded arrays the first one), or the cells. The
/// pieces of a .pvtu have to be in the folder of origin.path, in origin.includes, or below: Error{kFileUnreadable}.
MeshFile read_vtu(std::string_view bytes, const MeshLimits& limits = {}, const FileOrigin& origin = {});

}  // namespace ccslice
