// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Control meshes from files. The kind of a file is told from its first lines, never from its name.

#pragma once

#include <string>
#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

enum class MeshFileKind { kGmsh, kMedit, kVtk, kVtu, kOvm, kAbaqus, kExodus, kUnknown };

MeshFileKind mesh_file_kind(std::string_view bytes);

/// Reads whichever kind `bytes` are of. Throws Error (1xx, 4xx).
MeshFile read_mesh(std::string_view bytes, const MeshLimits& limits = {}, const FileOrigin& origin = {});

/// Reads the same, but leaves collapsed cells and pyramids as resolve_collapsed_cells() takes them: a caller that joins
/// points does so first, since a cell may be collapsed by points in one place.
MeshFile read_mesh_unresolved(std::string_view bytes, const MeshLimits& limits = {}, const FileOrigin& origin = {});

/// What a file is that isn't any of them: of a known format that isn't read, with the remedy, or "neither a Gmsh file
/// (...), nor ...", which callers may go on with.
struct UnreadFile {
  std::string text;
  bool known = false;
};
UnreadFile describe_unread(std::string_view bytes);

}  // namespace ccslice
