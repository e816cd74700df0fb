// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells given by their faces, as OpenVolumeMesh has them, and VTK's polyhedra, turned into cells given by their
// corners.
//
// The corners of the cell's base (a triangle of a tetrahedron or wedge, any face of a hexahedron) come first, and above
// each its neighbour outside the base: the only one that a face joins it to. A base whose corners run counter-clockwise
// seen from outside gives a positively oriented cell; validate() turns the others round.
//
// Pyramids are hexahedra whose corners 4 to 7 are one (core/mesh_import/collapsed_cells.h).

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

/// `rings` are the cell's faces, seen from either side. Nothing if they are not those of a hexahedron, a tetrahedron, a
/// wedge or a pyramid, or if corners of these are the same vertex.
[[nodiscard]] std::optional<CornersOfPolyhedron> corners_of_polyhedron(std::span<const FaceRing> rings);

/// What a cell is that has no corners by that: "a polyhedron of 12 faces ...".
std::string describe_polyhedron(std::span<const FaceRing> rings);

}  // namespace ccslice
