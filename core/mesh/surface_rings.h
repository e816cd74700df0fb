// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The surface of a mesh, which is its boundary and the interfaces of its cell regions, by the vertices of faces: what
// is left to know of it once its complex is gone.

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/types.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

/// The vertices of a face, counter-clockwise as it is seen; kNone closes triangles.
using FaceVertices = std::array<std::uint32_t, 4>;

struct SurfaceRings {
  std::vector<FaceVertices> boundary;    // Seen from outside.
  std::vector<FaceVertices> interfaces;  // Each once, seen from outside of the region of the lower number.
};

/// REQUIRES: `complex` has the mesh's cells.
SurfaceRings surface_rings(const ControlMesh& mesh, const CellComplex& complex);

/// Where a vertex is, mm.
using PlaceOfVertex = std::function<Vec3(std::uint32_t vertex)>;

/// An edge with two faces of the surface, and the angle between their normals, degrees: positive where the solid, or
/// the region of the lower number, lies inside the bend, negative where it lies outside.
struct SurfaceTurn {
  std::array<std::uint32_t, 2> edge{};  // The lesser vertex first.
  double deg = 0;
  bool on_interface = false;
};

/// The edges where the surface turns by at least so much either way, ascending. Edges with more than two faces, where
/// interfaces end, are sharp anyway and passed over. Quadrilaterals that aren't plane have the normal of their vector
/// area; faces without any are passed over.
std::vector<SurfaceTurn> surface_turns(const SurfaceRings& rings, const PlaceOfVertex& place, double least_deg);

}  // namespace ccslice
