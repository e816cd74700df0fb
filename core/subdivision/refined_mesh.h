// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Finer meshes of the same solid, to look at or to measure with: the slicer itself refines only where it must.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

/// The control mesh after so many refinements of every cell: hexahedra, the same limit. Children follow one another in
/// the order of their cells, as many as a cell has corners, eight for each of them from then on. Channels are rounded
/// to floats on the way; children are of their cells' regions. Missed vertices are forgotten. REQUIRES: a mesh as
/// validate() leaves it, without mid-nodes, split where it has several regions (mesh/cell_regions.h). Throws
/// Error{kCancelled}.
ControlMesh refine_mesh(const ControlMesh& mesh, int times, const CancellationToken& cancel = {});

/// How many cells that has.
std::size_t refined_cell_count(const ControlMesh& mesh, int times);

/// The mesh with every vertex at its limit point, which is where it is as meshed, and with the channels there. Not
/// interpolating. REQUIRES: a mesh as validate() leaves it, without mid-nodes, split likewise. Throws
/// Error{kCancelled}.
ControlMesh mesh_of_limit_points(const ControlMesh& mesh, const CancellationToken& cancel = {});

/// The cell of `mesh` that each cell of refine_mesh(mesh, times) came from.
std::vector<std::uint32_t> control_cells_of(const ControlMesh& mesh, int times);

}  // namespace ccslice
