// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether a cell is inside out: the determinants of the edge vectors at its corners.

#pragma once

#include <cstddef>

#include "core/base/types.h"
#include "core/mesh/cell_kind.h"

namespace ccslice {

/// The determinant of the three edge vectors at a corner, positive where the cell isn't inside out. Hexahedra's corners
/// are bits, where odd corners mirror. position_of(corner): of a corner in the same order.
template <typename PositionOf>
double corner_determinant(CellKind kind, std::size_t corner, PositionOf position_of) {
  const auto& neighbours = cell_topology(kind).corner_neighbours[corner];
  const Vec3 p = position_of(corner);
  Mat3 edges;
  for (int i = 0; i < 3; ++i) edges.col(i) = position_of(neighbours[static_cast<std::size_t>(i)]) - p;
  const bool mirrored = kind == CellKind::kHex && (corner == 1 || corner == 2 || corner == 4 || corner == 7);
  return mirrored ? -edges.determinant() : edges.determinant();
}

}  // namespace ccslice
