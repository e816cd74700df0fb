// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which of its nodes lies where in a second-order cell, told by their places: for formats that leave the order to who
// writes them, or nodes out. A node belongs to the edge, face or inside whose middle is near it, as no two have the
// same one.

#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/mesh/cell_kind.h"

namespace ccslice {

/// The middles of the cell's edges, quadrilaterals and, of a hexahedron, its inside, in the order of SecondOrderCells,
/// if it has straight edges. `corners` are in VTK's order.
std::vector<Vec3> middles(CellKind kind, std::span<const Vec3> corners);

/// The middles of faces and inside follow the nodes of the edges, of which `of_edges` has all [the blending of a
/// serendipity element].
void bend_middles(CellKind kind, std::span<const Vec3> corners, std::span<const Vec3> of_edges,
                  std::vector<Vec3>& middles);

/// One column for each row, all different, with the least sum of costs: O(rows^2 columns) [Kuhn, The Hungarian method].
/// REQUIRES: rows <= columns, and costs are finite.
std::vector<std::size_t> cheapest_columns(const Eigen::MatrixXd& costs);

}  // namespace ccslice
