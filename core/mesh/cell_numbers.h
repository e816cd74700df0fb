// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cell regions made of numbers that a file has for its cells.

#pragma once

#include <string>

#include "core/mesh/mesh_file.h"
#include "core/mesh/validate.h"

namespace ccslice {

/// Makes a cell region of each number, in ascending order and called by it. Throws Error{kMeshBadCellRegion} if the
/// file has no such numbers, naming those that it has, or if there are more than limits.max_cell_regions.
void make_cell_regions(const std::string& name, MeshFile& file, const MeshLimits& limits = {});

}  // namespace ccslice
