// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes as VTK's XML files of unstructured grids (.vtu), to look at in ParaView, PyVista and others [VTK File
// Formats]. Arrays are in base64, behind headers of 64 bits, not compressed: what every reader takes.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "core/prepare/bezier_cells.h"

namespace ccslice::cli {

/// A .vtu can have the mesh's mid-nodes, if any: every cell has some on all of its edges, as VTK's quadratic cells (24
/// to 26), or on none. There are none on faces and within cells, nor region_values.
bool vtu_keeps_mid_nodes(const ControlMesh& mesh);

/// Channels become point data, floats as they are. `control_cells`: by cell, cell data of that name; none if empty.
/// Cell regions become cell data "cell_region", their indices, and field data "cell_region:NAME", a number each, which
/// say what they are called. (VTK has arrays of strings, but meshio refuses files that have one.) Values of regions,
/// region_values, have no place: split such a mesh first.
/// Sharp edges and vertices have no place in the format. Mid-nodes become points after the vertices where
/// vtu_keeps_mid_nodes(), and are left out elsewhere.
std::string to_vtu(const ControlMesh& mesh, std::span<const std::uint32_t> control_cells = {});

/// Bezier hexahedra of degree 3 (VTK_BEZIER_HEXAHEDRON) and plain ones, with cell data "control_cell" and
/// "HigherOrderDegrees". What reads it has to know VTK 9's order of points: ParaView from 5.8 on.
std::string to_vtu(const BezierCells& cells, const std::vector<std::string>& channel_names,
                   const std::vector<std::string>& region_names = {});

}  // namespace ccslice::cli
