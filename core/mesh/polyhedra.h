// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells given by their faces, as OpenVolumeMesh has them, turned into cells given by their corners.
//
// The corners of the cell's base (a triangle of a tetrahedron or wedge, any face of a hexahedron) come first, and above
// each its neighbour outside the base: the only one that a face joins it to. Half-faces whose corners run
// counter-clockwise seen from outside give positively oriented cells; validate() turns the others round.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice {

/// The corners of a face in their cyclic order.
using FaceRing = std::vector<std::uint32_t>;

struct CornersOfPolyhedron {
  CellKind kind = CellKind::kHex;
  std::vector<std::uint32_t> corners;  // VTK order.
};

/// `rings` are the cell's faces, all seen from the same side of its boundary. Nothing if they are not those of a
/// hexahedron, a tetrahedron or a wedge.
[[nodiscard]] std::optional<CornersOfPolyhedron> corners_of_polyhedron(std::span<const FaceRing> rings);

/// What a cell is that has no corners by that, and what to do: "a pyramid, ...".
std::string describe_polyhedron(std::span<const FaceRing> rings);

}  // namespace ccslice
