// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Larger meshes of the same solids.

#pragma once

#include "core/mesh/control_mesh.h"

namespace ccslice::bench {

/// The control mesh after so many refinements of every cell: 8^times the cells, the same limit. REQUIRES: a valid mesh
/// of hexahedra. Channels are rounded to floats on the way.
ControlMesh refine_mesh(const ControlMesh& mesh, int times);

/// `count` copies, each `distance_mm` above the last: separate parts.
ControlMesh stack_meshes(const ControlMesh& mesh, int count, double distance_mm);

}  // namespace ccslice::bench
