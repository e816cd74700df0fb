// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Programs that run on several machines write a .vtu for each, and a .pvtu that names them all. One of them alone is a
// piece of the part, which nothing in it has to say.

#pragma once

#include <string>

#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Adds a note if a .pvtu in the folder of `path`, or in the one above, names it among others, or if there are files
/// beside it whose names differ by a number at the end only (NAME_0.vtu, NAME_p0.vtu).
void add_partition_note(const std::string& path, MeshFile& file);

}  // namespace ccslice
