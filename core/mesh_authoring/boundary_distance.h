// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How deep the control points lie: their distance, in mm, from the boundary faces of the control mesh. A quadrilateral
// needn't be plane; it counts as the four triangles between its edges and the mean of its corners.

#pragma once

#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice {

/// One distance for each vertex, exactly 0 on the boundary. Takes time in proportion to n log n. REQUIRES: a mesh that
/// validate() takes.
std::vector<double> distances_to_boundary(const ControlMesh& mesh);

}  // namespace ccslice
