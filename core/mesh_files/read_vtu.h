// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// VTK's XML files of unstructured grids, .vtu [VTK XML Formats]: arrays as text, in base64 or appended (raw or base64),
// plain or compressed with zlib, LZ4 or LZMA, in either byte order. Cells and point data become what they do in legacy
// files (core/mesh_files/read_vtk.h).
//
// PIECES are merged: a point that lies exactly where a point of an earlier piece does is the same vertex, with the
// earlier one's values. Cells that VTK marks as copies of another piece's (vtkGhostType) are left out. A channel has to
// be in every piece.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error{kFileSyntax, kFileUnsupported, kMeshNonFinite, kMeshTooLarge, kMeshUnsupportedCell,
/// kMeshIndexOutOfRange, kMeshEmpty}; messages name the byte (of encoded arrays the first one), or the cells.
MeshFile read_vtu(std::string_view bytes, const MeshLimits& limits = {});

}  // namespace ccslice
