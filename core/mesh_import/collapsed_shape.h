// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The shape of a cell with repeated corners follows from the faces that are left of it, once repeated corners are one
// and faces with fewer than three are gone.

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

enum class CollapsedShape : std::uint8_t { kCell, kPyramid, kTetOverQuadrilateral };

struct CollapsedCell {
  CollapsedShape shape = CollapsedShape::kCell;
  CellKind kind = CellKind::kTet;                  // A pyramid's: of its halves.
  std::vector<std::uint32_t> corners;              // A pyramid's: its base, then its apex.
  std::array<std::uint32_t, 4> base{};             // In cyclic order, unless it is a plain cell.
  std::array<std::uint32_t, 2> diagonal_of_tet{};  // Over a quadrilateral: the edge that halves it.
};

inline std::array<std::uint32_t, 2> sorted_ends(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

bool has_repeated_corner(std::span<const std::uint32_t> corners);

/// The face's corners in cyclic order, of a triangle three and a zero. `corners`: in VTK's order.
std::array<std::uint32_t, 4> corners_of_face(CellKind kind, const LocalFace& face,
                                             std::span<const std::uint32_t> corners);

/// Nothing if it is no wedge, tetrahedron or pyramid. REQUIRES: a corner is repeated.
std::optional<CollapsedCell> what_is_left(CellKind kind, std::span<const std::uint32_t> corners);

}  // namespace ccslice
