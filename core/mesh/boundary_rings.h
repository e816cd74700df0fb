// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The boundary of a mesh, by the vertices of its faces: what is left to know of it once its complex is gone.

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/types.h"
#include "core/mesh/cell_complex.h"

namespace ccslice {

/// Faces of the boundary by their vertices, seen from outside; kNone closes triangles.
using BoundaryRings = std::vector<std::array<std::uint32_t, 4>>;

BoundaryRings boundary_rings(const CellComplex& complex);

/// Where a vertex is, mm.
using PlaceOfVertex = std::function<Vec3(std::uint32_t vertex)>;

/// An edge of the boundary, and the angle between the outward normals of its two faces, degrees: positive where the
/// solid lies inside the bend, negative where it lies outside.
struct SurfaceTurn {
  std::array<std::uint32_t, 2> edge{};  // The lesser vertex first.
  double deg = 0;
};

/// The edges where the surface turns by at least so much either way, ascending. Quadrilaterals that aren't plane have
/// the normal of their vector area; faces without any are passed over.
std::vector<SurfaceTurn> surface_turns(const BoundaryRings& rings, const PlaceOfVertex& place, double least_deg);

}  // namespace ccslice
