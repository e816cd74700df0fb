// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// VTK's cell types [VTK 9.5, Common/DataModel/vtkCellType.h], and where the points of each stand. Corners come first,
// in the order of control meshes (but those of a voxel); then the nodes of the edges, of the quadrilaterals and of the
// hexahedron, in the order of SecondOrderCells, whichever of them a type has.
//
// LAGRANGE and BEZIER cells have as many points as their degrees ask for, which may differ by axis. Of degree 1 they
// are ordinary cells; of degree 2 they have the order of the types 29 and 32. (VTK's description of type 29 tells
// another order of its quadrilaterals than its parametric coordinates, which count.)

#pragma once

#include <cstdint>
#include <optional>

#include "core/mesh/cell_kind.h"

namespace ccslice {

inline constexpr std::uint16_t kVtkVoxel = 11, kVtkPolyhedron = 42;

enum class VtkFamily : std::uint8_t {
  kUnknown,
  kFlat,        // Points, lines and faces.
  kFixed,       // One number of points.
  kLagrange,    // Any degrees.
  kBezier,      // Likewise, their points being control points.
  kPolyhedron,  // Given by its faces.
};

/// Pyramids are hexahedra whose corners 4 to 7 are one.
struct VtkCellType {
  VtkFamily family = VtkFamily::kUnknown;
  CellKind kind = CellKind::kHex;
  bool pyramid = false;
  std::uint8_t points = 0;  // Of kFixed.

  std::uint64_t corners() const { return pyramid ? 5 : static_cast<std::uint64_t>(corner_count(kind)); }
};

const VtkCellType& vtk_cell_type(std::uint16_t type);

/// The degree of a cell of so many points: 1, 2, or 3 for all others. Nothing if no degrees give so many.
std::optional<int> vtk_degree(const VtkCellType& type, std::uint64_t points);

}  // namespace ccslice
