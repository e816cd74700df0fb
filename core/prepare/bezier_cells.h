// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The limit volume as Bezier cells, for programs that draw them. Wherever the limit is one tricubic patch, so is its
// part over any box of parameters: 4 x 4 x 4 Bezier points, exact but for rounding. A regular cell is one such box.
// Towards its irregular line or vertex a cell is an endless nest of patches: it is cut into halves along each axis (but
// not along its line), what is one patch is left whole, the rest cut again, and after so many cuts the boxes at the
// line or vertex remain as hexahedra of limit points, the only ones that aren't exact. Of the parameters of a line cell
// they hold 4^-levels. Faces of different sizes that meet have no points in common.
//
// A tricubic polynomial is known by its values at 0, 1/3, 2/3 and 1 along each axis, from which the Bezier points
// follow by a fixed matrix.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {

struct BezierCells {
  std::vector<Vec3> points;                  // mm, mesh frame; cells of a region share those of common faces.
  std::vector<float> channel_values;         // As ControlMesh has them, by point.
  std::vector<std::uint32_t> cell_points;    // Of one cell after the other.
  std::vector<std::uint8_t> cell_orders;     // 3: 64 points, i + 4 j + 16 k. 1: 8 corners, i + 2 j + 4 k.
  std::vector<std::uint32_t> control_cells;  // That each cell came from.
  std::vector<std::uint8_t> cell_regions;    // By cell; empty in a mesh without regions.
};

/// At most so many cells come of it.
inline constexpr std::size_t kMostBezierCells = 2'000'000;

/// `levels`: how often irregular cells are cut, at least 0. Throws Error{kMeshTooLarge} for more than kMostBezierCells,
/// and Error{kCancelled}.
BezierCells bezier_cells(const LimitSolid& solid, int levels, const CancellationToken& cancel = {});

/// Prepares the mesh first. Throws also what prepare_solid() does.
BezierCells bezier_cells(ControlMesh mesh, int levels, const PrepareOptions& options = {});

}  // namespace ccslice
