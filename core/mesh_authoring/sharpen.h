// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sharp features for meshes that come without any: subdivision creases on the boundary and on interfaces of cell
// regions, without which every edge of a machined part comes out round.
//
// BY ANGLE. At a boundary edge the surface turns by the angle between the outward normals of its two boundary faces: 0
// where it goes straight on, 90 degrees at a box's edges. An edge that turns by at least the given angle is sharp. It
// is convex where the solid lies inside the bend, reentrant where it lies outside. A reentrant sharp edge has two or
// three cells that the limit squeezes against it and often folds, so these are kept apart. So are edges of interfaces:
// each is reentrant for one of its two regions. Edges where an interface ends are sharp anyway.

#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice {

/// An edge by its vertices, the lesser first.
using SharpEdge = std::array<std::uint32_t, 2>;

struct SharpEdges {
  std::vector<SharpEdge> convex, reentrant, interface;  // Ascending.
};

/// The edges of boundary and interfaces that turn by at least `least_angle_deg`. Quadrilaterals that aren't plane have
/// the normal of their vector area; faces without any are passed over. REQUIRES: a mesh as validate() leaves it.
SharpEdges find_sharp_edges(const ControlMesh& mesh, double least_angle_deg);

struct SharpFeatures {
  std::vector<SharpEdge> edges;
  std::vector<std::uint32_t> vertices;
};

/// Reads a list of sharp features: on each line the ids of an edge's two vertices, or one id of a corner that stays
/// where it is. Ids count from 0; '#' opens a comment. Throws Error{kFileSyntax} naming the line and the token. That
/// they are edges and vertices of boundary or interfaces is validate()'s business.
SharpFeatures read_sharp_features(std::string_view text);

/// Tags the features that the mesh hasn't tagged yet.
void add_sharp_features(const SharpFeatures& features, ControlMesh& mesh);

}  // namespace ccslice
