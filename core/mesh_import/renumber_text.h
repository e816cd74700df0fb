// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Messages in the numbers of the file that a mesh came from. The core counts vertices and cells from 0; Abaqus's
// elements begin anywhere. Whatever is said of them, by the core here or by a server far away, names them as
// offenders.h does, so one function finds the ids in any text: a noun ("cell", "vertices", "edge"), then ids with
// commas or "and" between them. It puts the file's nouns and numbers in, and says where the first one is.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice {

/// The ids that a text may name. Others that look alike are something else, and stay. nullopt: all that the mesh has.
/// Nothing looks like a mid-node: any that the mesh has may be named.
struct IdsInText {
  std::optional<std::vector<std::int64_t>> vertices = std::nullopt;
  std::optional<std::vector<std::int64_t>> cells = std::nullopt;
};

/// `text` with the file's nouns and numbers in place of ids. A list names each of the file's cells once, although they
/// may have become several of the mesh's. With `mesh`, which must be the one that the ids are of,
/// the place of the first thing is added behind the first list, unless the text has a place already.
std::string renumber_text(std::string_view text, const FileNumbers& numbers, const IdsInText& ids = {},
                          const ControlMesh* mesh = nullptr);

/// Whether the text names one of these.
bool names_any(std::string_view text, const IdsInText& ids);

/// The file's number of a vertex or of a cell: its id if the file has none.
std::uint64_t file_vertex(const FileNumbers& numbers, std::size_t vertex);
std::uint64_t file_cell(const FileNumbers& numbers, std::size_t cell);

/// "(1, 2.5, -3) mm", with six digits of the largest.
std::string place_in_mm(const Vec3& place);

/// Throws Error{kMeshIndexOutOfRange}, which names cells with vertices that there aren't by the file's numbers.
void check_cell_vertices(const MeshFile& file);

}  // namespace ccslice
