// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Material channels made of numbers that a file has for its cells, such as densities of a topology optimization.

#pragma once

#include <cstdint>
#include <string>

#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Whose cells a vertex's mean is taken over. By region it jumps across interfaces.
enum class MeanOver : std::uint8_t { kAllCells, kEachRegion };

/// Adds a channel of that name: at each vertex the mean of the numbers of its cells, weighted by their volumes. Throws
/// Error{kMeshBadChannel} if the file has no such numbers, or a channel of that name already, Error{kMeshBadCellRegion}
/// for means of each region of a mesh without regions, and Error{kMeshNonFinite} with the ids of cells whose numbers
/// are no finite floats. REQUIRES: every vertex is one of some cell.
void average_cell_numbers(const std::string& name, MeanOver over, MeshFile& file);

}  // namespace ccslice
