// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Bezier cells of second order have control points where Lagrange cells have nodes. The node is the cell's point there:
//
//   of an edge            a/4 + m/2 + b/4, with corners a and b and the control point m
//   of a quadrilateral    the same along both axes: corners 1/16, edges 1/8, its own control point 1/4
//   of a hexahedron       along three: corners 1/64, edges 1/32, quadrilaterals 1/16, its own 1/8
//
// Material channels follow the same weights.

#pragma once

#include <cstddef>
#include <span>

#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Replaces the control points of these cells of `file.second_order` (by their places in it, ascending) by nodes.
/// REQUIRES: the mesh has its channels; the cells' vertices and nodes exist.
void make_nodes_of_control_points(std::span<const std::size_t> places, MeshFile& file);

}  // namespace ccslice
